"""Codes of an 8400 motec, and the CAN stack that is made of them."""

from __future__ import annotations

import pytest

from bridge.sim.lenze.lenze_settings import (
    LENZE_BASE,
    OWN_COB_ID,
    PORT_IN,
    LenzeCodes,
    communication,
    heartbeat_step,
)


@pytest.mark.parametrize(("asked", "used"), [(0, 0), (4, 0), (5, 5), (203, 200)])
def test_heartbeat_times_are_rounded_down(asked: int, used: int) -> None:
    assert heartbeat_step(asked) == used


@pytest.mark.parametrize(
    ("source", "received"), [(1, [0x205, 0x305]), (LENZE_BASE, [0x205, 0x286]), (OWN_COB_ID, [0x205, 0x305])]
)
def test_identifiers_come_from_their_base(source: int, received: list[int]) -> None:
    made = communication(LenzeCodes(5, cob_source=[source, source]), (4, 2))
    assert [pdo.cob_id for pdo in made.rpdo] == received
    assert made.rpdo[1].mapping == [PORT_IN << 16 | sub << 8 | 16 for sub in (5, 6)]


def test_another_address_moves_what_depends_on_it() -> None:
    codes = LenzeCodes(5)
    before = list(codes.cob_ids)
    codes.move_to(6)
    assert codes.cob_ids == [one + 1 for one in before]
    assert communication(codes, (4, 4)).emcy.cob_id == 0x86


def test_the_second_sdo_channel_is_switched_by_c00366() -> None:
    codes = LenzeCodes(5)
    assert [one.enabled for one in communication(codes, (4, 4)).sdo] == [True, False]
    codes.use_both_sdo_channels(True)
    assert communication(codes, (4, 4)).sdo[1].receive.cob_id == 0x645
    codes.use_both_sdo_channels(False)
    assert not communication(codes, (4, 4)).sdo[1].enabled
