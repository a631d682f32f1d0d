"""Events of the last hours, bounded, in order, and by the objects that told them; no server."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

from asyncua import ua

from bridge.northbound.opcua.events.event_file import EventLog, read_records
from bridge.northbound.opcua.events.event_records import EventRecord
from tests.support.opcua_events import event_log, record

HOUR = 3_600_000_000
SERVER = ua.NodeId(ua.ObjectIds.Server)


def seen(log: EventLog, where: ua.NodeId, now: int = 0) -> list[int]:
    history = log.history(where, now)
    assert history is not None
    numbers = range(history.first, history.end)
    return [history.time_us(number) for number in numbers if history.event(number)]


def test_each_object_has_the_events_that_it_has_told() -> None:
    log = event_log()
    sources = ("conveyor/fu1", "can0", "conveyor", "pump", "elsewhere")
    log.add([record(time, source) for time, source in enumerate(sources)], 0)
    assert seen(log, SERVER) == [0, 1, 2, 3, 4]
    assert seen(log, ua.NodeId("conveyor", 2)) == [0, 2]
    assert seen(log, ua.NodeId("conveyor/fu1", 2)) == [0]
    assert seen(log, ua.NodeId("bus/can0", 2)) == [1]
    assert seen(log, ua.NodeId("bridge", 2)) == [4]
    assert log.history(ua.NodeId("conveyor/fu1/status/state", 2), 0) is None


def test_an_event_is_told_with_its_fields_by_that_object() -> None:
    log = event_log()
    log.add([record(5)], 0)
    history = log.history(SERVER, 0)
    event = history and history.event(0)
    assert event is not None
    assert event.emitter == SERVER
    assert event.fields["Severity"].Value == 800


def test_events_are_forgotten_after_their_hours() -> None:
    log = event_log(hours=2)
    log.add([record(0), record(HOUR), record(2 * HOUR)], 2 * HOUR)
    assert seen(log, SERVER, 2 * HOUR) == [0, HOUR, 2 * HOUR]
    assert seen(log, SERVER, 2 * HOUR + 1) == [HOUR, 2 * HOUR]
    log.add([record(9 * HOUR)], 9 * HOUR)
    assert (log.first, log.end) == (3, 4)
    assert seen(log, SERVER, 99 * HOUR) == []


def test_a_hundred_thousand_events_take_no_more_memory_than_a_thousand() -> None:
    log = event_log(most_bytes=500_000)
    line = bytearray(record(0).line)
    tracemalloc.start()

    def size_after(count: int) -> int:
        for number in range(count):
            log.add([EventRecord(number, "conveyor/fu1", bytes(line))], 0)
        return tracemalloc.get_traced_memory()[0]

    few, many = size_after(2_000), size_after(98_000)
    tracemalloc.stop()
    assert few < 700_000
    assert many < 1.05 * few
    assert log.end == 100_000
    assert 500 < log.end - log.first < 1_500


class TestFile:
    def test_both_files_are_read_in_their_order(self, tmp_path: Path) -> None:
        path = tmp_path / "events.jsonl"
        assert read_records(path) == []
        (tmp_path / "events.jsonl.1").write_bytes(record(1).line + record(2).line)
        assert read_records(path) == [record(1), record(2)]
        path.write_bytes(record(3).line)
        assert read_records(path) == [record(1), record(2), record(3)]

    def test_a_torn_last_line_is_taken_away(self, tmp_path: Path) -> None:
        path = tmp_path / "events.jsonl"
        path.write_bytes(record(1).line + record(2).line[:-9])
        assert read_records(path) == [record(1)]
        with path.open("ab") as file:
            file.write(record(3).line)
        assert read_records(path) == [record(1), record(3)]

    def test_a_line_in_between_that_is_none_is_left_out(self, tmp_path: Path) -> None:
        path = tmp_path / "events.jsonl"
        path.write_bytes(record(1).line + b"nonsense\n" + record(3).line)
        assert read_records(path) == [record(1), record(3)]
