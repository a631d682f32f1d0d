"""Letters of a failed boot-up (CiA 302-2) and what helps."""

from __future__ import annotations

from bridge.node.boot.error_status import ABSENT, HINTS, BootError
from bridge.text import Text

LETTERS = "BCDEFJKLMNO"
"""Of the standard's those that the bridge tells of a node."""


def test_what_helps_is_told_of_letters_of_the_standard() -> None:
    assert HINTS.keys() | ABSENT <= set(LETTERS)


def test_a_failure_is_told_with_what_helps() -> None:
    error = BootError("L", Text.of("boot.has_no", object="1018h:04"))
    assert (str(error), error.detail) == ("L: the node has no 1018h:04", "the node has no 1018h:04")
    hint = Text.of("boot_hint.manual")
    assert str(BootError("L", error.what, hint=hint)).endswith(
        ": compare the site file with the device's manual"
    )
