"""The published sum: every term that belongs to a setting is in it, and no other."""

from __future__ import annotations

import pytest

from bridge.command.messages.freshness import GRAIN_MS
from bridge.command.worst_case import Wire, stop_time, sync_wait_ms, takeover_ms
from bridge.config import BusTable, DriveTable
from bridge.text import render
from tests.support.docs import REPOSITORY

WIRE = Wire(frames_ms=0.54, before_ms=5.06)


def bus(**keys: object) -> BusTable:
    return BusTable.model_validate({"name": "can0", "interface": "socketcan", **keys})


def drive(**keys: object) -> DriveTable:
    return DriveTable.model_validate({"slot": "fu1", "control": "modbus", "fieldbus_timeout_ms": 200, **keys})


def terms(table: DriveTable, of_bus: BusTable, kind: int = 255, wire: Wire = WIRE) -> dict[str, float]:
    return {term.name: term.ms for term in stop_time(table, of_bus, 200, kind, wire).terms}


PLAIN = {
    "way_ms": GRAIN_MS,
    "timeout_ms": 200,
    "reaction_ms": 20,
    "burst_ms": 10,
    "period_ms": 10,
    "before_ms": 5.06,
    "frames_ms": 0.54,
}


def test_a_drive_with_nothing_special() -> None:
    assert terms(drive(), bus()) == PLAIN
    assert stop_time(drive(), bus(), 200, 255, WIRE).ms == 271


@pytest.mark.parametrize(("kind", "periods"), [(0, 1), (1, 1), (5, 5), (240, 240)])
def test_a_synchronous_rpdo_waits_for_sync_and_sync_may_be_late(kind: int, periods: int) -> None:
    found = terms(drive(), bus(), kind)
    assert found == PLAIN | {"sync_ms": 10 * periods, "sync_late_ms": 5.06}


def test_the_last_synchronous_transmission_type_is_240() -> None:
    """CiA 301 v4.2.0 §7.5.2.35."""
    assert terms(drive(), bus(), 240)["sync_ms"] == 2400
    assert terms(drive(), bus(), 241) == PLAIN
    assert (sync_wait_ms(bus(), 241), takeover_ms(bus(), 241)) == (0, 0)


@pytest.mark.parametrize(
    ("period_ms", "kind", "wait_ms"),
    [(10, 0, 10), (10, 1, 10), (10, 5, 50), (10, 240, 2400), (10, 255, 0), (0, 0, 0), (0, 5, 0)],
)
def test_a_word_on_the_bus_waits_for_sync_and_for_the_bridge(period_ms: int, kind: int, wait_ms: int) -> None:
    of_bus = bus(sync_period_ms=period_ms)
    assert sync_wait_ms(of_bus, kind) == wait_ms
    late_ms = 20 if kind <= 240 else 0
    # For a SYNC that somebody else sends, it is not waited longer than a tenth of a second.
    assert takeover_ms(of_bus, kind) == (wait_ms or (100 if late_ms else 0)) + late_ms


def test_the_sum_is_written_with_three_digits_where_it_is_below_a_millisecond() -> None:
    stop = stop_time(drive(), bus(), 200, 255, Wire(frames_ms=0.54321, before_ms=1.0625))
    assert stop.sum == (
        "way_ms 25 + timeout_ms 200 + reaction_ms 20 + burst_ms 10 + period_ms 10 + before_ms 1.0625 "
        "+ frames_ms 0.543"
    )


@pytest.mark.parametrize("kind", [0, 1, 240])
def test_a_foreign_sync_producer_leaves_no_number(kind: int) -> None:
    stop = stop_time(drive(), bus(sync_period_ms=0), 200, kind, WIRE)
    assert (stop.ms, stop.terms) == (0, ())
    assert f"transmission type {kind}" in render(stop.unknown)
    assert str(stop).startswith("not known: ")


def test_without_sync_the_period_is_that_of_the_rpdos() -> None:
    found = terms(drive(), bus(sync_period_ms=0, rpdo_period_ms=50))
    assert (found["burst_ms"], found["period_ms"]) == (50, 50)


def test_a_bus_behind_a_thread_has_its_queue() -> None:
    assert terms(drive(), bus(interface="slcan"))["queue_ms"] == 50
    assert "queue_ms" not in terms(drive(), bus(interface="virtual"))


def test_with_silence_the_drives_own_time_out_is_in_it() -> None:
    silent = drive(on_expiry="silence")
    assert stop_time(silent, bus(), 200, 255, WIRE, 300.0).terms[-1].ms == 300
    assert stop_time(silent, bus(), 200, 255, WIRE, 0.0) == stop_time(drive(), bus(), 200, 255, WIRE), (
        "it gets disable voltage where it has none"
    )
    assert stop_time(drive(), bus(), 200, 255, WIRE, 300.0) == stop_time(drive(), bus(), 200, 255, WIRE)
    assert "not been read" in render(stop_time(silent, bus(), 200, 255, WIRE, None).unknown)


def test_a_full_bus_leaves_no_number() -> None:
    assert "more than 100 %" in render(stop_time(drive(), bus(), 200, 255, Wire(0.5, None)).unknown)


@pytest.mark.parametrize("keys", [{"on_expiry": "hold"}, {"telegram_downtime_s": -0.1}])
def test_where_nothing_stops_the_drive_there_is_no_sum(keys: dict[str, object]) -> None:
    stop = stop_time(drive(**keys), bus(), 200, 255, WIRE)
    assert (stop.ms, stop.unknown, str(stop)) == (0, "", "never")
    assert str(stop_time(drive(), bus(), 0, 255, WIRE)) == "never"


def test_the_page_names_every_term() -> None:
    page = (REPOSITORY / "docs/explanation/dead-man-chain.md").read_text(encoding="utf-8")
    rows = [line.split("`") for line in page.splitlines() if line.startswith("| `")]
    named = {row[1] for row in rows if row[1].endswith("_ms") and row[2].startswith(" | ")}
    silent = stop_time(drive(on_expiry="silence"), bus(interface="slcan"), 200, 5, WIRE, 300.0)
    assert named == {term.name for term in silent.terms}
