"""Requests that are no reads or writes of a unit: wrong functions and counts, exceptions, loopback."""

from __future__ import annotations

import pytest

from bridge.command import Code
from bridge.northbound.modbus.dispatch import EXCEPTIONS
from tests.support.modbus_site import (
    SWITCH_ON_INHIBITED,
    Rig,
)


@pytest.mark.landing(29)
@pytest.mark.parametrize(
    ("pdu", "answer"),
    [
        ("00", "80 01"),
        ("07", "87 01"),  # read exception status, §6.7
        ("63 00", "E3 01"),
        ("83 00", "83 01"),
        ("2B 0D 00", "AB 01"),  # CANopen general reference, a later issue
        ("2B 0E 05 00", "AB 03"),
        ("2B 0E 00 00", "AB 03"),
        ("2B 0E 01", "AB 03"),
        ("2B", "AB 03"),
        ("08 0001 0000", "88 01"),
        ("08 00", "88 03"),
        ("03 0000 0000", "83 03"),
        ("03 0000 007E", "83 03"),
        ("04 0000 0000", "84 03"),
        ("04 0000", "84 03"),
        ("04 0000 0001 00", "84 03"),
        ("01 0000 07D1", "81 03"),
        ("02 0000 0000", "82 03"),
        ("05 0000 0001", "85 03"),
        ("06 0000", "86 03"),
        ("0F 0000 0008 02 0000", "8F 03"),
        ("0F 0000 0009 01 00", "8F 03"),
        ("0F 0000 0000 00", "8F 03"),
        ("10 0000 0001 02 00", "90 03"),
        ("10 0000 0001 04 0000 0000", "90 03"),
        ("10 0000 0000 00", "90 03"),
        ("16 0000 0000", "96 03"),
        ("17 0000 0000 0000 0001 02 047E", "97 03"),
        ("17 0000 0001 0000 0001 02 04", "97 03"),
    ],
)
def test_wrong_functions_and_counts_name_the_right_function(pdu: str, answer: str):
    rig = Rig()
    rig.runs(SWITCH_ON_INHIBITED)
    assert rig.ask(pdu).hex(" ").upper() == answer
    assert rig.fu1.channel.owner is None


def test_every_outcome_has_its_exception():
    assert set(EXCEPTIONS) == set(Code) - {Code.OK}


def test_loopback():
    assert Rig().ask("08 0000 A537") == bytes.fromhex("08 0000 A537")
