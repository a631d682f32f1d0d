"""Letters of a failed boot-up (CiA 302-2) and their texts."""

from __future__ import annotations

from bridge.node.boot.status import HINTS, TEXTS


def test_every_letter_of_the_standard_has_its_text() -> None:
    assert "".join(sorted(TEXTS)) == "ABCDEFGHIJKLMNO"
    assert HINTS.keys() <= TEXTS.keys()
