"""Addresses that a client is told: its own words, where they lead here."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.uaserver.own_addresses import OwnAddresses

CONFIGURED = "opc.tcp://hall3:4840/drivebridge"
OURS = OwnAddresses(["hall3", "192.168.1.7", "fd00::7"], ["opc.tcp://plant.example:14840", "opc.tcp://gate"])


@pytest.mark.parametrize(
    ("asked", "place"),
    [
        ("opc.tcp://hall3:4840", "hall3:4840"),
        ("opc.tcp://HALL3.:9999/else", "HALL3.:9999"),
        ("opc.tcp://192.168.1.7/", "192.168.1.7"),
        ("opc.tcp://[fd00:0:0::7]:4840", "[fd00:0:0::7]:4840"),
        ("opc.tcp://plant.example:14840", "plant.example:14840"),
        ("opc.tcp://gate:4840", "gate:4840"),
        ("opc.tcp://user:secret@hall3:1", "hall3:1"),
    ],
)
def test_what_leads_here_is_repeated(asked: str, place: str) -> None:
    assert OURS.answer(CONFIGURED, asked) == f"opc.tcp://{place}/drivebridge"


@pytest.mark.parametrize(
    "asked",
    [
        None,
        "",
        "opc.tcp://elsewhere:4840",
        "opc.tcp://plant.example:4840",
        "opc.tcp://gate:4841",
        "http://hall3:4840",
        "opc.tcp://hall3:port",
        "opc.tcp://hall3:99999",
        "opc.tcp://[fd00::7",
        "hall3:4840",
    ],
)
def test_what_does_not_is_never(asked: str | None) -> None:
    assert OURS.answer(CONFIGURED, asked) == CONFIGURED


def test_the_address_of_the_connection_is_ours() -> None:
    assert (
        OURS.answer(CONFIGURED, "opc.tcp://10.0.0.5:4840", "10.0.0.5")
        == "opc.tcp://10.0.0.5:4840/drivebridge"
    )


@given(st.text(max_size=60))
def test_whatever_is_asked_there_is_an_answer(asked: str) -> None:
    assert OURS.answer(CONFIGURED, asked) == CONFIGURED
    OURS.answer(CONFIGURED, f"opc.tcp://{asked}")
