"""Other names of communication objects: parameters that hold, or determine, what 1000h … 1FFFh hold."""

from __future__ import annotations

from typing import Annotated, Final, cast

from pydantic import BeforeValidator, Field, WithJsonSchema

from bridge.mapping.entry_types import Ref, Table
from bridge.text import Text
from bridge.tomlfile import Unfit

COMMUNICATION: Final = range(0x1000, 0x2000)
"""The communication profile area (CiA 301 §7.5.1)."""


def _split(value: object) -> object:
    """Objects in a text, or in a list of texts, separated by spaces. Raises ``Unfit``."""
    texts = cast("list[object]", value) if isinstance(value, list) else [value]
    if not texts or not all(isinstance(text, str) and text.split() for text in texts):
        raise Unfit(Text.of("mapping.alias_form"))
    return [str(text).split() for text in texts]


Targets = Annotated[
    list[list[Ref]],
    BeforeValidator(_split),
    WithJsonSchema(
        {"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}, "minItems": 1}]}
    ),
]


class Aliases(Table):
    """Objects for which a parameter stands, by the maker's name. A list goes on with the next elements of the
    parameter. ``same`` holds the object's value, ``related`` decides it in another form."""

    same: dict[str, Targets] = Field(default_factory=dict[str, Targets])
    related: dict[str, Targets] = Field(default_factory=dict[str, Targets])
