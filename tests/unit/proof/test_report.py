"""The tables of the fault injection: nothing that failed or is missing looks like a success."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import pytest

from tests.proof import kills
from tests.proof.faults import FAULTS
from tests.proof.report import BEGIN, END, KINDS, cells, failures, markdown, merge, put_into, summary
from tests.support.process import REPOSITORY

PAGE = REPOSITORY / "docs" / "explanation" / "proof.md"
FIGURES = REPOSITORY / "docs" / "reference" / "proof-figures.md"


def record(**change: Any) -> dict[str, Any]:
    return {
        "fault": "owner killed",
        "family": "NORD SK TU4-CAO",
        "protocol": "modbus",
        "bus_ms": 500.0,
        "bus_bound_ms": 570.0,
        "drive_ms": 600.0,
        "drive_bound_ms": 720.0,
        "way_ms": 3.0,
        "sent_ms": 503.0,
        "sent_bound_ms": 820.0,
        "over_ms": 0.0,
        "noise_ms": 0.0,
        "verdict": "ok",
        **change,
    }


def result(*samples: dict[str, Any], **change: Any) -> dict[str, Any]:
    return {
        "date": "2026-11-21",
        "machine": "a machine",
        "plant": "first",
        "faults": ["owner killed", "bus-off"],
        "faults_missing": [],
        "cells": [["owner killed", "NORD SK TU4-CAO", "modbus", 1]],
        "cycles": 1,
        "seconds": 60.0,
        "by_themselves": 0,
        "stopped_in_vain": [],
        "errors": [],
        "samples": list(samples),
        **change,
    }


def test_a_row_has_median_worst_and_bound() -> None:
    (cell,) = cells([record(bus_ms=400.0), record(), record(bus_ms=560.0)])
    assert cell.row()[3:] == ["3", "3", "503", "820", "500", "560", "570", "600", "600", "720", "ok"]


def test_what_failed_is_named_and_fails_the_proof() -> None:
    found = result(record(), record(verdict="failed"))
    assert "**1 failed**" in markdown(found)
    assert failures(found, 2) == ["owner killed, NORD SK TU4-CAO, modbus: 1 of 2 failed"]


def test_what_is_void_is_none_of_those_that_are_needed_and_is_shown_all_the_same() -> None:
    late = record(bus_ms=580.0, over_ms=10.0, verdict="void")
    (cell,) = cells([record(), late])
    assert cell.row()[3] == "1"
    assert cell.row()[8] == "580", "worst"
    assert cell.row()[-1] == "1 void: late by up to 10.0 ms, and the machine was in the way for that"
    found = result(record(), late)
    assert failures(found, 2) == ["owner killed, NORD SK TU4-CAO, modbus: only 1 samples of 2"]
    assert "1 measurements: 0 failed. Void, and made again: 1," in markdown(found)


def test_a_cell_with_nothing_but_void_samples_fails_the_proof() -> None:
    found = failures(result(record(over_ms=10.0, verdict="void")), 1)
    assert found == ["owner killed, NORD SK TU4-CAO, modbus: only 0 samples of 1"]


def test_too_few_samples_fail_the_proof() -> None:
    assert failures(result(record()), 2) == ["owner killed, NORD SK TU4-CAO, modbus: only 1 samples of 2"]
    assert failures(result(record(), record()), 2) == []


def test_a_cell_without_any_sample_fails_the_proof() -> None:
    cells = [["owner killed", "NORD SK TU4-CAO", "modbus", 1], ["bus-off", "CiA 402", "zenoh", 1]]
    found = failures(result(record(), cells=cells), 1)
    assert found == ["bus-off, CiA 402, zenoh: only 0 samples of 1"]


def test_a_round_that_injects_a_fault_several_times_counts_as_often() -> None:
    found = result(record(), record(), cells=[["owner killed", "NORD SK TU4-CAO", "modbus", 3]])
    assert failures(found, 6) == []
    assert failures(found, 7) == ["owner killed, NORD SK TU4-CAO, modbus: only 2 samples of 3"]


def test_drives_that_stop_without_a_fault_of_theirs_fail_the_proof_where_they_are_many() -> None:
    some = [record() for _ in range(500)]
    assert failures(result(*some, by_themselves=5, stopped_in_vain=["a"] * 5), 1) == []
    found = failures(result(*some, by_themselves=6, stopped_in_vain=["a"] * 6), 1)
    assert found == [
        "6 drives stopped beside a fault that did not concern them, 5 may",
        "6 drives were found stopped before a fault, 5 may be",
    ]


def test_on_a_busy_machine_each_drive_may_stop_twice_by_itself() -> None:
    busy = record(noise_ms=150.0)
    assert failures(result(busy, by_themselves=26, stopped_in_vain=["a"] * 26), 1) == []
    assert len(failures(result(busy, by_themselves=27, stopped_in_vain=["a"] * 27), 1)) == 2
    assert len(failures(result(record(), by_themselves=4, stopped_in_vain=["a"] * 4), 1)) == 2


def test_errors_of_any_machine_fail_the_proof() -> None:
    both = merge([result(record()), result(record(), errors=["bus-off: not stopped"])])
    assert len(both["samples"]) == 2
    assert failures(both, 2) == ["bus-off: not stopped"]


def test_the_pages_keep_what_is_not_between_the_marks(tmp_path: Path) -> None:
    page, figures = tmp_path / "proof.md", tmp_path / "proof-figures.md"
    for path in (page, figures):
        path.write_text(f"before\n{BEGIN}\nold\n{END}\nafter\n", encoding="utf-8")
    put_into(page, figures, result(record()))
    texts = [path.read_text(encoding="utf-8") for path in (page, figures)]
    for text in texts:
        assert text.startswith("before\n")
        assert text.endswith(f"{END}\nafter\n")
        assert "old" not in text
    assert "| controller | 1 | 1 | 0 | 0 | 500 of 570 | 600 of 720 |" in texts[0]
    assert "| owner killed | NORD SK TU4-CAO | modbus |" in texts[1]


def test_a_page_without_marks_is_an_error(tmp_path: Path) -> None:
    page = tmp_path / "proof.md"
    page.write_text("nothing\n", encoding="utf-8")
    with pytest.raises(ValueError, match="has no markers"):
        put_into(page, page, result(record()))


def test_every_fault_has_one_kind() -> None:
    named = [name for names in KINDS.values() for name in names]
    assert sorted(named) == sorted(fault.name for fault in FAULTS)


def test_the_summary_shows_for_each_kind_what_came_closest_to_its_bound() -> None:
    quick = record(family="CiA 402", bus_ms=90.0, bus_bound_ms=100.0, drive_ms=100.0, drive_bound_ms=200.0)
    text = summary(result(record(), quick, record(fault="bus-off", drive_ms=None)))
    assert "| controller | 1 | 2 | 0 | 0 | 90 of 100 | 600 of 720 |" in text
    assert "| bus | 1 | 1 | 0 | 0 | 500 of 570 | – |" in text
    assert "| front |" not in text


def test_the_summary_counts_what_failed_and_what_is_void() -> None:
    late = record(bus_ms=580.0, over_ms=10.0, verdict="void")
    text = summary(result(record(), record(verdict="failed"), late))
    assert "| controller | 1 | 2 | **1** | 1 | 580 of 570 | 600 of 720 |" in text


@pytest.mark.parametrize(("path", "made"), [(PAGE, summary), (FIGURES, markdown)], ids=["page", "figures"])
def test_the_pages_in_the_documentation_are_as_the_program_writes_them(path: Path, made: Any) -> None:
    text = path.read_text(encoding="utf-8")
    for begin, end in ((BEGIN, END), (kills.BEGIN, kills.END)):
        assert text.count(begin) == text.count(end) == 1
    lines = made(result(record(), yes())).splitlines()
    heads = [line for line, below in itertools.pairwise(lines) if below.startswith("|---")]
    assert heads
    assert [head for head in heads if f"\n{head}\n" not in text] == []


def test_the_page_of_the_proof_is_two_pages_long() -> None:
    assert len(PAGE.read_text(encoding="utf-8").split()) <= 950


def yes(**change: Any) -> dict[str, Any]:
    judged = record(fault="second connection", drive_ms=None, way_ms=None, sent_ms=None, bus_ms=None)
    return {**judged, "demand": "each of its words is refused", **change}


def test_what_is_judged_by_yes_or_no_has_a_table_of_its_own() -> None:
    page = markdown(result(record(), yes(), yes()))
    times, _, demands = page.partition("Judged by yes or no")
    row = (
        "| second connection | NORD SK TU4-CAO | modbus | each of its words is refused | 2 | – | – | – | ok |"
    )
    assert row in demands
    assert "second connection" not in times
    assert "| owner killed |" in times and "| owner killed |" not in demands


def test_a_no_is_named_and_fails_the_proof() -> None:
    found = result(
        yes(), yes(verdict="failed"), cells=[["second connection", "NORD SK TU4-CAO", "modbus", 1]]
    )
    assert "| 2 | – | – | – | **1 failed** |" in markdown(found)
    assert failures(found, 2) == ["second connection, NORD SK TU4-CAO, modbus: 1 of 2 failed"]


def test_a_stop_that_was_asked_for_has_its_time_beside_the_verdict() -> None:
    page = markdown(result(yes(bus_ms=40.0, bus_bound_ms=320.0)))
    assert "| each of its words is refused | 1 | 40 | 40 | 320 | ok |" in page


def test_a_page_without_such_faults_has_no_such_table() -> None:
    assert "Judged by yes or no" not in markdown(result(record()))
