"""Frames that an 8400 motec sends by itself, and those that it counts."""

from __future__ import annotations

import pytest

from bridge.sim.lenze.lenze_settings import LenzeCodes, communication
from bridge.sim.lenze.lenze_traffic import QuasiMaster, counters_of


@pytest.mark.parametrize(("master", "at"), [(0, None), (1, 12.0)])
def test_a_master_starts_the_others_once_after_its_time(master: int, at: float | None) -> None:
    made = QuasiMaster(lambda: LenzeCodes(5, master=master, times_ms=[2000, 0, 0, 0, 0]))
    made.start(10.0)
    assert made.next_deadline() == at
    assert not made.due(11.9)
    assert [made.due(12.0), made.due(13.0)] == [at is not None, False]


def test_a_frame_counts_for_its_direction_and_its_channel() -> None:
    settings = communication(LenzeCodes(5), (4, 4))
    assert counters_of(0x205, settings, sent=False) == (2, 8)
    assert counters_of(0x605, settings, sent=False) == (2, 11)
    assert counters_of(0x185, settings, sent=True) == (1, 3)
    assert counters_of(0x185, settings, sent=False) == ()
    assert counters_of(0, settings, sent=True) == ()
