"""The user of a session that nobody has activated."""

from __future__ import annotations

from bridge.uaserver.application import NOBODY, Nobody


def test_nobody_has_no_rights_and_is_like_no_other() -> None:
    assert (NOBODY.name, NOBODY.is_anonymous, NOBODY.rank) == ("", True, -1)
    assert not NOBODY.is_same(Nobody())
    assert NOBODY.is_same(NOBODY)
