"""Silences on a bus beside what the site file allows."""

from __future__ import annotations

import pytest

from bridge.bustools.silence_watch import Bound, SilenceWatch, bounds
from bridge.canopen.frame import Frame
from bridge.config import BusTable

SYNC, RPDO, HEARTBEAT = 0x080, 0x205, 0x705
ALLOWED = {SYNC: Bound("SYNC", 100, "deadman_ms")}


def table(**values: object) -> BusTable:
    node = {"name": "conveyor", "id": 5, "mapping": "nord/sk-tu4-cao", "supervision_ms": 300}
    node |= {"supervision": values.pop("supervision", "heartbeat"), "enabled": values.pop("enabled", True)}
    content = {"name": "can0", "interface": "socketcan", "channel": "can0", "node": [node]}
    return BusTable.model_validate(content | values)


def watch(*times: float, end: float) -> list[str]:
    """Sentences on SYNC at these times, in a trace that begins at 10 s."""
    silences = SilenceWatch(ALLOWED)
    for time in times:
        silences.on_frame(Frame(SYNC, b"", time), f"line {round(time * 100)}")
        silences.on_frame(Frame(0x181, b"", time), "elsewhere")
    return silences.said(10.0, end)


def test_the_longest_silence_is_said_with_its_beginning_and_how_often_there_was_one() -> None:
    assert watch(10.0, 10.05, 10.3, 10.35, 10.5, end=10.55) == [
        "line 1005: SYNC: silent for 250 ms from 0.050 s on, deadman_ms allows 100 ms, 2 times in all"
    ]


@pytest.mark.parametrize(("end", "count"), [(10.1, 0), (10.2, 1)])
def test_a_silence_may_last_until_the_end(end: float, count: int) -> None:
    assert len(watch(10.0, 10.05, end=end)) == count


def test_what_was_never_heard_is_not_judged() -> None:
    assert watch(end=99.0) == []


def test_the_bounds_are_those_of_the_site_file() -> None:
    found = bounds(table(), {RPDO: "RPDO1 conveyor/fu1"})
    assert found == {
        SYNC: Bound("SYNC", 100, "deadman_ms"),
        RPDO: Bound("RPDO1 conveyor/fu1", 100, "deadman_ms"),
        HEARTBEAT: Bound("heartbeat conveyor", 300, "supervision_ms"),
    }


def test_a_long_period_may_pass_twice() -> None:
    found = bounds(table(sync_period_ms=100, rpdo_period_ms=80), {RPDO: "RPDO1 conveyor/fu1"})
    assert found[SYNC] == Bound("SYNC", 200, "twice sync_period_ms")
    assert found[RPDO] == Bound("RPDO1 conveyor/fu1", 160, "twice rpdo_period_ms")


@pytest.mark.parametrize("said", [{"supervision": "guarding"}, {"enabled": False}])
def test_a_node_without_a_heartbeat_is_not_judged_by_one(said: dict[str, object]) -> None:
    assert HEARTBEAT not in bounds(table(**said), {})


def test_without_sync_nobody_waits_for_it() -> None:
    assert SYNC not in bounds(table(sync_period_ms=0), {})
