"""Connections to zenoh's port that are reported as strangers'."""

from __future__ import annotations

import pytest

from bridge.zenohlink.strangers import PATIENCE_S, Strangers

PLC, IDLE = "10.0.0.1:40000", "10.0.0.66:50000"


def test_who_comes_to_no_session_is_told_once() -> None:
    strangers = Strangers()
    strangers.on_connections([PLC, IDLE], 100.0)
    strangers.came(PLC)
    assert strangers.take(100.0 + PATIENCE_S / 2) == []
    assert strangers.take(100.0 + PATIENCE_S) == [IDLE]
    assert strangers.take(200.0) == []


def test_a_session_may_be_known_before_its_connection_is_found() -> None:
    strangers = Strangers()
    strangers.came(PLC)
    strangers.on_connections([PLC], 100.0)
    assert strangers.take(200.0) == []


def test_a_place_that_had_a_session_may_be_a_strangers_later() -> None:
    strangers = Strangers()
    strangers.came(PLC)
    strangers.went(PLC)
    strangers.on_connections([PLC], 100.0)
    assert strangers.take(200.0) == [PLC]


@pytest.mark.parametrize("link", ["[fe80::1%2]:7447", "[fe80::1]:7447", "[fe80::1%2]:7447?rel=1;prio=0-7"])
def test_what_else_stands_in_an_address_does_not_matter(link: str) -> None:
    strangers = Strangers()
    strangers.on_connections(["[fe80::1%eth0]:7447"], 100.0)
    strangers.came(link)
    assert strangers.take(200.0) == []
