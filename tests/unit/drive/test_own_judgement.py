"""Own supervision of a drive when the bridge falls silent: verdicts, sums and reasons, by its objects."""

from __future__ import annotations

import pytest

from bridge.config import BusTable, NodeTable
from bridge.drive.own_judgement import DriveWatch, OwnJudgement, OwnVerdict, judge, why_silence_does_not_stop
from bridge.text import render
from tests.support import sites

STOPS, RUNS, UNKNOWN = OwnVerdict.STOPS, OwnVerdict.RUNS_ON, OwnVerdict.UNKNOWN


def watch(
    verdict: OwnVerdict | None, time_ms: float | None = 100.0, silent_ms: int = 50, **more: str
) -> DriveWatch:
    keys = {"name": "P513", "watches": "process_data", "why": "why", **more}
    return DriveWatch(keys["name"], keys["watches"], "set", time_ms, "stops", verdict, keys["why"], silent_ms)


def test_the_first_to_stop_it_counts_with_its_silence() -> None:
    own = OwnJudgement((watch(STOPS, 300.0), watch(STOPS, 200.0, name="1016"), watch(RUNS, 1.0)))
    assert own.first is not None
    assert own.first.name == "1016"
    assert (own.verdict, own.own_ms, own.bridge_ms, own.reason) == (STOPS, 200.0, 250, "")
    assert own.terms == (("silent_ms", 50), ("own_ms", 200.0))
    assert own.sum == "silent_ms 50 + own_ms 200"


@pytest.mark.parametrize(
    ("watches", "verdict", "reason"),
    [
        ((), UNKNOWN, "the mapping says nothing of the drive's own supervision"),
        ((watch(None),), UNKNOWN, "the mapping says nothing of the drive's own supervision"),
        ((watch(RUNS, why="off"), watch(RUNS, why="off")), RUNS, "off"),
        ((watch(RUNS, why="off"), watch(RUNS, why="idle")), RUNS, "off; idle"),
        ((watch(RUNS, why="off"), watch(UNKNOWN, why="not read")), UNKNOWN, "not read"),
    ],
)
def test_where_nothing_stops_it_the_reason_is_told_once(
    watches: tuple[DriveWatch, ...], verdict: OwnVerdict, reason: str
) -> None:
    own = OwnJudgement(watches)
    assert (own.verdict, own.reason) == (verdict, reason)
    assert (own.own_ms, own.bridge_ms, own.terms, own.sum) == (0, 0, (), "")


def test_process_data_are_watched_by_the_shortest_that_stops() -> None:
    own = OwnJudgement((watch(STOPS, 300.0), watch(STOPS, 90.0), watch(STOPS, 10.0, watches="heartbeat")))
    assert own.process_data_ms == 90.0
    assert OwnJudgement((watch(RUNS, 90.0),)).process_data_ms == 0.0


NORD = sites.family(sites.FAMILY)
LENZE = sites.family("lenze/8400-motec")


def tables(count: int = 1, **node: object) -> tuple[BusTable, NodeTable]:
    drives = [{"slot": f"fu{number}"} for number in range(1, count + 1)]
    keys = {"name": "n", "id": 5, "mapping": sites.FAMILY, "drive": drives, **node}
    bus = {"name": "can0", "interface": "virtual", "deadman_ms": 100, "heartbeat_ms": 200}
    return BusTable.model_validate(bus), NodeTable.model_validate(keys)


def test_what_was_not_read_is_not_known() -> None:
    bus, node = tables()
    own = judge(LENZE, {}, bus, node)
    assert own.verdict is UNKNOWN
    assert all(one.why.endswith("is not known") for one in own.watches)


@pytest.mark.parametrize(
    ("number", "verdict", "why"),
    [
        (127 << 16 | 300, STOPS, ""),
        (126 << 16 | 300, RUNS, "watches node 126, the bridge is 127"),
        (0, RUNS, "is 0: it watches no heartbeat"),
        (127 << 16, RUNS, "is 0: it watches no heartbeat"),
    ],
)
def test_a_heartbeat_is_watched_where_it_is_the_bridges(number: int, verdict: OwnVerdict, why: str) -> None:
    """CiA 301 §7.5.2.13: bits 16 … 23 are the node, bits 0 … 15 the time."""
    bus, node = tables()
    raw = {(0x1016, 1): number}
    raw |= {(index, sub): 1 for index in (0x5DAE, 0x5DAF, 0x6007) for sub in range(8)}
    (own,) = (one for one in judge(LENZE, raw, bus, node).watches if one.watches == "heartbeat")
    if verdict is RUNS:
        assert own.verdict is RUNS
        assert own.why.endswith(why)
    else:
        assert (own.time_ms, own.silent_ms) == (300.0, 200), "the longer of dead-man time and heartbeat"


def test_a_reaction_that_stops_nothing_is_in_the_makers_words_in_both_languages() -> None:
    bus, node = tables()
    raw = {(index, sub): 0 for index in (0x5DAE, 0x5DAF) for sub in range(8)} | {(0x5E9A, 1): 100}
    found = [one.because for one in judge(LENZE, raw, bus, node).watches if one.watches == "process_data"]
    (why,) = (one for one in found if render(one).startswith("C00593/1"))
    assert [render(why, language) for language in ("en", "de")] == [
        "C00593/1 is 0 (no reaction): it runs on",
        "C00593/1 ist 0 (Keine Reaktion): er läuft weiter",
    ]


def test_silence_of_its_process_data_stops_a_drive_that_watches_them_and_is_alone_on_its_node() -> None:
    """P151 is of the node: with the RPDOs of another drive it never runs out (BU 2500 §7.1)."""
    stops = OwnJudgement((watch(STOPS, 100.0, name="P151"),))
    runs = OwnJudgement((watch(RUNS, 0.0, name="P151", why="P151 is 0 (off)"),))
    assert why_silence_does_not_stop(NORD, stops, tables()[1]) == ""
    assert render(why_silence_does_not_stop(NORD, runs, tables()[1])) == "P151 is 0 (off)"
    shared = "P151 watches the RPDOs of all 2 drives of the node: those of the others go on"
    assert render(why_silence_does_not_stop(NORD, stops, tables(2)[1])) == shared


def test_silence_is_no_stop_where_something_else_is_watched() -> None:
    why = why_silence_does_not_stop(sites.family("stoeber/5000"), OwnJudgement(), tables()[1])
    assert render(why).endswith("watches life guarding, and not its process data: that goes on")
