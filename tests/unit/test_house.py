"""Counts of `make house`."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.process import REPOSITORY
from tools.house import House, circles

FILES = {
    "bridge/__init__.py": "",
    "bridge/loose.py": "from bridge.room.plant import Plant\n",
    "bridge/room/__init__.py": "",
    "bridge/room/plant.py": (
        "from bridge.room import drive\n"
        "class Plant:\n"
        "    def __init__(self, a, *, b):\n"
        "        self.one = a\n"
        "        self.two = self.one\n"
        "        self.two = b\n"
    ),
    "bridge/room/drive.py": "from bridge.room.plant import Plant\nclass Drive: ...\n",
    "bridge/node/drive.py": (
        "Tell = Callable[[int], None]\n"
        "class Drive: ...\n"
        "class Made:\n"
        "    count: Tell\n"
        "    def __init__(self, node, count: int, *, tell: Tell | None): ...\n"
        "class Place(NamedTuple):\n"
        "    word: int\n"
        "    of: Callable[[], int]\n"
        "@dataclass(slots=True)\n"
        "class Line:\n"
        "    clock: Callable[[], float]\n"
        "class Seen(Protocol):\n"
        "    told: Tell\n"
        "def tell(self, node):\n"
        "    self._plant.report(node.device)\n"
        "    self.plant.on_node(1)\n"
        "    self.image.set(2)\n"
    ),
    "tests/unit/room/test_drive.py": "",
    "bridge/northbound/page/static/js/texts/said-de.json": '[["stopped", "steht"], ["{n} ms", "{n} ms"]]',
}


ALLOWED = {
    # Given by the shell that runs a core: clocks, timers, chance, what it watches.
    "BusLine.clock",
    "LoopTimer.clock",
    "LoopTimer.wake",
    "Master.alive",
    "Master.clock",
    "Master.slept",
    "Network.epoch_ns",
    "PlantView.carry_out",
    "PlantView.clock",
    "PlantView.epoch_ns",
    "PlantView.wake",
    "Standby.spread",
    "SuspendWatch.look",
    # Functions that answer to nobody: a decoder, a rule, the frame after a burst.
    "LegSettings.decode",
    "Repetition.then",
    "StopRule.of",
    # The stop check takes each output of a channel before the report that follows it in the same frame.
    "Channel.settled",
    "DriveChannel.settled",
    "OutputChannel.settled",
}
"""Callables that constructors in command, node and master may take. Effects are returned instead."""


def house(folder: Path) -> House:
    for name, text in FILES.items():
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    return House(folder)


def test_rooms_and_circles_are_counted(tmp_path: Path) -> None:
    made = house(tmp_path)
    assert made.loose() == ["loose"]
    assert made.circles() == [{"bridge.room.plant", "bridge.room.drive"}]
    assert made.repeated_modules() == ["drive"]
    assert made.repeated_classes() == ["Drive"]
    assert [file.name for file in made.with_twins()] == ["drive.py"]
    assert len(made.tested) == 4


def test_what_is_in_too_many_rooms_is_counted(tmp_path: Path) -> None:
    made = house(tmp_path)
    assert made.calls_of_plant() == 2
    assert made.naming("Plant") == []
    assert made.with_branches() == ["bridge.node.drive"]
    assert made.callables_taken() == ["Line.clock", "Made.tell", "Place.of"]
    assert (made.attributes("Plant"), made.parameters("Plant"), made.lines("Plant")) == (2, 2, 4)
    assert made.attributes("Nobody") is None
    assert made.phrases() == (2, 1)


def test_a_circle_may_have_several_steps() -> None:
    needs = {"a": {"b"}, "b": {"c"}, "c": {"a", "d"}, "d": set[str](), "e": {"a"}}
    assert circles(needs) == [{"a", "b", "c"}]
    assert circles({"a": {"b"}, "b": set()}) == []


@pytest.mark.landing
def test_the_house_has_no_loose_modules_and_no_circles() -> None:
    made = House(REPOSITORY)
    assert made.loose() == ["exports", "project"]
    assert made.circles() == []
    assert set(made.callables_taken()) == ALLOWED
    assert all(row.now for row in made.rows())
