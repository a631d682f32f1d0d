"""Aliases of communication objects: how a mapping file writes them."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from bridge.mapping.aliases import COMMUNICATION, Aliases
from bridge.mapping.entry_types import ObjectRef

TYPE, INHIBIT = ObjectRef(0x1400, 2), ObjectRef(0x1400, 3)


@pytest.mark.parametrize(
    ("text", "objects"),
    [
        ("1400:02", [[TYPE]]),
        ("1400:02 1400:03", [[TYPE, INHIBIT]]),
        (["1400:02", "1400:03"], [[TYPE], [INHIBIT]]),
    ],
)
def test_a_text_is_for_one_parameter_and_a_list_goes_on_with_its_elements(
    text: object, objects: list[list[ObjectRef]]
) -> None:
    assert Aliases.model_validate({"same": {"P515": text}}).same == {"P515": objects}


@pytest.mark.parametrize("text", ["", [], [""], 5, ["1400:02", 5], None])
def test_anything_else_is_refused(text: object) -> None:
    with pytest.raises(ValidationError, match="must be objects as"):
        Aliases.model_validate({"related": {"P515": text}})


def test_what_belongs_to_the_communication() -> None:
    """CiA 301 §7.5.1: 1000h … 1FFFh."""
    assert [index in COMMUNICATION for index in (0x0FFF, 0x1000, 0x1FFF, 0x2000)] == [
        False,
        True,
        True,
        False,
    ]
