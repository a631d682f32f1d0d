"""Other names of communication objects: parameters that hold, or determine, what 1000h … 1FFFh hold."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Final, cast

from pydantic import BeforeValidator, Field, WithJsonSchema

from bridge.mapping.fields import ObjectRef, Ref, Table
from bridge.mapping.parameters import object_of

if TYPE_CHECKING:
    from bridge.mapping.model import Family


COMMUNICATION: Final = range(0x1000, 0x2000)
"""The communication profile area (CiA 301 §7.5.1)."""


def _split(value: object) -> object:
    """A text, or a list of texts, of objects apart by spaces."""
    texts = cast("list[object]", value) if isinstance(value, list) else [value]
    if not texts or not all(isinstance(text, str) and text.split() for text in texts):
        raise ValueError('must be objects as "1400:02", apart by spaces, or a list with one for each element')
    return [str(text).split() for text in texts]


Targets = Annotated[
    list[list[Ref]],
    BeforeValidator(_split),
    WithJsonSchema(
        {"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}, "minItems": 1}]}
    ),
]


class Aliases(Table):
    """By the maker's name: the objects for which a parameter stands. A list goes on with the next elements
    of the parameter. ``same`` holds the object's value, ``related`` decides it in another form."""

    same: dict[str, Targets] = Field(default_factory=dict[str, Targets])
    related: dict[str, Targets] = Field(default_factory=dict[str, Targets])


@dataclass(frozen=True, slots=True)
class Alias:
    """``name`` is the parameter that the mapping file names, with "…" for one of its further elements;
    ``ref`` is where it stands in the object dictionary."""

    name: str
    ref: ObjectRef
    objects: tuple[ObjectRef, ...]
    is_same: bool


def aliases(family: Family) -> Iterator[Alias]:
    """Every parameter, and every element of one, that stands for other objects.

    Raises ValueError for a name that is no parameter of the family; the mapping's checks find that first.
    """
    for is_same, table in ((True, family.aliases.same), (False, family.aliases.related)):
        for name, targets in table.items():
            first = place_of(family, name)
            for n, objects in enumerate(targets):
                ref = ObjectRef(first.index, first.sub + n)
                yield Alias(name if not n else f"{name} …", ref, tuple(objects), is_same)


def place_of(family: Family, name: str) -> ObjectRef:
    """Where the parameter stands that an alias names. Raises ValueError where it is none."""
    for parameter in family.parameter:
        if parameter.name == name and parameter.object is not None:
            return parameter.object
    if family.parameter_names is None:
        raise ValueError("names of parameters need [parameter_names]")
    return object_of(family.parameter_names, name)
