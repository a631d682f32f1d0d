"""The hunt for seeded faults: nothing that was not found looks like a success."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tests.proof.faults import FAULTS
from tests.proof.hunt import Share, order
from tests.proof.kills import BEGIN, END, failures, markdown, merge


def kill(name: str, judgement: str = "the drive after 9 ms, 8 allowed") -> dict[str, Any]:
    fault = "owner killed" if judgement else ""
    return {
        "mutant": name,
        "breaks": "much",
        "fault": fault,
        "judgement": judgement,
        "seconds": 9.1,
        "rounds": 1,
    }


def result(*kills: dict[str, Any], **change: Any) -> dict[str, Any]:
    return {
        "date": "2026-11-22",
        "machine": "a machine",
        "machines": 1,
        "seconds": 120.0,
        "mutants": ["one", "two"],
        "false_alarms": [],
        "kills": list(kills),
        **change,
    }


def test_each_mutant_has_a_row_in_the_order_of_the_table() -> None:
    both = merge([result(kill("two")), result(kill("one"), seconds=180.0)])
    text = markdown(both)
    assert text.index("| one | much | owner killed | the drive after 9 ms, 8 allowed | 9 |") < text.index(
        "| two"
    )
    assert "2 at a time, 3 min. 2 of 2 were found, and 0 faults in the program as it is." in text
    assert text.startswith(BEGIN)
    assert text.endswith(END)
    assert failures(both) == []


def test_a_survivor_and_one_that_nobody_tried_fail_it() -> None:
    found = result(kill("one", ""))
    assert failures(found) == ["not tried: two", "survived: one"]
    assert "| one | much | **survived** |" in markdown(found)


def test_a_fault_that_is_found_in_the_program_as_it_is_fails_it() -> None:
    found = result(kill("one"), kill("two"), false_alarms=["bus-off: late"])
    assert failures(found) == ["false alarm: bus-off: late"]


def test_every_fault_is_tried_and_the_likely_one_first_and_again() -> None:
    names = [fault.name for fault in order("bus-off")]
    assert names[:3] == ["bus-off"] * 3
    assert set(names) == {fault.name for fault in FAULTS if fault.possible()}
    assert sorted(names[3:]) == sorted(set(names) - {"bus-off"})


def test_what_one_machine_takes_no_other_does(tmp_path: Path) -> None:
    assert Share(tmp_path).take("a/b")
    assert not Share(tmp_path).take("a/b")
    assert Share(tmp_path).take("a")
