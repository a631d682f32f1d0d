"""How long the words of what is commanded take: until their frame, and until SYNC takes them over."""

from __future__ import annotations

import pytest

from bridge.command.commanded import WordTiming
from bridge.config import BusTable


def commanded(kind: int | None = None) -> WordTiming:
    keys = {
        "name": "can0",
        "interface": "virtual",
        "sync_period_ms": 40,
        "rpdo_period_ms": 10,
        "deadman_ms": 100,
    }
    one = WordTiming(BusTable.model_validate(keys))
    if kind is not None:
        one.rpdo_type = kind
    return one


def test_a_bus_may_have_been_told_for_the_dead_man_time_and_a_period() -> None:
    assert commanded().burst_s == pytest.approx(0.11)


@pytest.mark.parametrize(
    ("kind", "ms"),
    [(None, 10), (255, 10), (254, 10), (0, 50), (1, 50), (3, 130)],
)
def test_a_word_waits_for_its_frame_and_for_as_many_syncs_as_its_type_says(kind: int | None, ms: int) -> None:
    """CiA 301 §7.5.2.35: type n takes effect with every n-th SYNC, type 0 with the next."""
    assert commanded(kind).rpdo_period_ms == ms


def test_a_stopped_word_of_an_asynchronous_rpdo_waits_for_nothing() -> None:
    assert commanded(255).takeover_s == 0.0
    assert commanded(1).takeover_s >= 0.040
