"""The hunt for seeded faults: nothing that was not found looks like a success."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import pytest

from tests.proof import hunt
from tests.proof.faults import FAULTS
from tests.proof.hunt import Share, order
from tests.proof.kills import BEGIN, END, failures, markdown, merge, put_into, survivors
from tests.proof.measure import Sample
from tests.proof.rig import NotStopped, Rig, Stuck


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


def test_the_page_has_the_count_and_the_figures_the_table(tmp_path: Path) -> None:
    page, figures = tmp_path / "proof.md", tmp_path / "proof-figures.md"
    for path in (page, figures):
        path.write_text(f"before\n{BEGIN}\n{END}\nafter\n", encoding="utf-8")
    put_into(page, figures, result(kill("one"), kill("two")))
    assert "2 of 2 were found" in page.read_text(encoding="utf-8")
    assert "| one |" not in page.read_text(encoding="utf-8")
    assert "| one | much |" in figures.read_text(encoding="utf-8")


def test_a_survivor_and_one_that_nobody_tried_fail_it() -> None:
    found = result(kill("one", ""))
    assert failures(found) == ["not tried: two", "survived: one"]
    assert "| one | much | **survived** |" in markdown(found)


def test_what_lives_on_one_plant_may_be_found_on_the_other() -> None:
    first = result(kill("one", ""), kill("two"))
    assert survivors(first) == ["one"]
    both = merge([first, result(kill("one"), mutants=["one"])])
    assert failures(both) == []
    assert "1 at a time" in markdown(both)
    assert survivors(merge([first, result(kill("one", ""), mutants=["one"])])) == ["one"]


def test_a_fault_that_is_found_in_the_program_as_it_is_fails_it() -> None:
    found = result(kill("one"), kill("two"), false_alarms=["bus-off: late"])
    assert failures(found) == ["false alarm: bus-off: late"]


def test_every_fault_is_tried_and_the_likely_one_first_and_again() -> None:
    names = [fault.name for fault in order("bus-off")]
    assert names[:3] == ["bus-off"] * 3
    assert set(names) == {fault.name for fault in FAULTS if fault.is_here}
    assert sorted(names[3:]) == sorted(set(names) - {"bus-off"})


def test_what_one_machine_takes_no_other_does(tmp_path: Path) -> None:
    assert Share(tmp_path).take("a/b")
    assert not Share(tmp_path).take("a/b")
    assert Share(tmp_path).take("a")


class Scene:
    """A plant whose rounds end as they are told."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, *ends: list[Sample] | Exception) -> None:
        self.stopped_in_vain: list[str] = []
        self.excused: list[str] = []
        self.mended = 0
        self.excuses: list[str] = []
        """What the machine is blamed for, round by round."""
        self._ends = list(ends)
        monkeypatch.setattr(hunt, "run_round", self._round)

    def _round(self, *_: object) -> list[Sample]:
        end = self._ends.pop(0)
        self.excused += [self.excuses.pop(0)] if self.excuses else []
        if isinstance(end, Exception):
            raise end
        return end

    def mend(self) -> None:
        self.mended += 1

    def run_all(self) -> None:
        pass


GOOD = Sample("bus-off", "CiA 402", "modbus", "fan/drive", bus_ms=100.0, bus_bound_ms=120.0)
LATE = replace(GOOD, bus_ms=150.0)


def judged(scene: Scene) -> str:
    return hunt.judge(cast("Rig", scene), FAULTS[0], lambda text: None)


def test_a_drive_that_is_late_or_goes_on_is_a_finding(monkeypatch: pytest.MonkeyPatch) -> None:
    assert judged(Scene(monkeypatch, [GOOD])) == ""
    assert (
        judged(Scene(monkeypatch, [GOOD, LATE])) == "fan/drive (modbus): on the bus after 150 ms, 120 allowed"
    )
    assert judged(Scene(monkeypatch, NotStopped("not stopped: fan"))) == "not stopped: fan"
    assert judged(Scene(monkeypatch, ProcessLookupError())) == "the bridge has ended"


def test_what_the_machine_was_in_the_way_of_is_made_again(monkeypatch: pytest.MonkeyPatch) -> None:
    void = replace(LATE, paused_ms=60.0)
    assert void.verdict == "void"
    late = "fan/drive (modbus): on the bus after 150 ms, 120 allowed"
    assert judged(Scene(monkeypatch, [void], [], [LATE])) == late
    assert judged(Scene(monkeypatch, [void], [GOOD])) == ""
    asked = next(fault for fault in FAULTS if fault.examine and len(fault.subjects) > 1)
    wrong = replace(GOOD, wrong="it moves")
    scene = Scene(monkeypatch, [GOOD], [wrong])
    assert hunt.judge(cast("Rig", scene), asked, lambda text: None) == "fan/drive (modbus): it moves"


def test_who_is_always_in_the_way_finds_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = Scene(monkeypatch, *[[replace(LATE, paused_ms=60.0)] for _ in range(20)])
    assert judged(scene) == ""


@pytest.mark.parametrize(
    ("excuses", "found"),
    [
        (["fan: it moves"] * 4, "fan: it moves"),
        (["fan: it moves", "fan: it moves", "lift: it moves", "fan: it moves"], ""),
        (["fan: it moves"] * 3, ""),
    ],
)
def test_what_is_excused_each_time_in_the_same_words_is_not_the_machines(
    monkeypatch: pytest.MonkeyPatch, excuses: list[str], found: str
) -> None:
    scene = Scene(monkeypatch, *[list[Sample]() for _ in range(4)])
    scene.excuses = list(excuses)
    assert judged(scene) == found


def test_a_plant_that_does_not_come_back_is_one_the_second_time(monkeypatch: pytest.MonkeyPatch) -> None:
    once = Scene(monkeypatch, Stuck("no process data"), [GOOD])
    assert judged(once) == ""
    assert once.mended == 1
    assert judged(Scene(monkeypatch, Stuck("no process data"), Stuck("no process data"))) == "no process data"
