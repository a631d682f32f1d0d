"""What the bridge says of the whole is judged, and one that says what is so is left alone."""

from __future__ import annotations

import json

import pytest

from tests.plant.oracle import Oracle
from tests.plant.summaries import ALARM, DANGER, Summaries
from tests.proof.drives import DRIVES
from tests.proof.settings import PLANT

DRIVE = DRIVES[0]
BUS = "bus/can0/condition"
NODE = f"{DRIVE.node}/node/condition"
ALL = "bridge/condition"
LATER_S = 2.0 + PLANT.heartbeat_ms / 1000


class Bridge:
    """It says that everything is in order."""

    def __init__(self) -> None:
        self.said: dict[str, float | None] = {}
        self.lines: list[tuple[str, str]] = []

    def good_number(self, name: str) -> float | None:
        return self.said.get(name, 0)

    def text(self, name: str) -> str:
        assert name == "bridge/troubles"
        return json.dumps([{"kind": kind, "place": place} for kind, place in self.lines])


class Scene:
    """A plant in order at 1030 s."""

    def __init__(self) -> None:
        self.oracle = Oracle([DRIVE])
        self.summaries = Summaries(self.oracle, "can0")
        self.bridge = Bridge()
        self.now = 1030.0

    def later(self, seconds: float, *, runs: bool = False, is_told: bool = True) -> str:
        """What is found wrong within these seconds; its drive ``runs``, and ``is_told`` to."""
        ends = self.now + seconds
        while self.now < ends:
            self.now += 0.25
            if runs:
                word = DRIVE.family.enabled[1].to_bytes(2, "little")
                self.oracle.frame(self.now, DRIVE.tpdo, word, of_bridge=False)
                if is_told:
                    self.oracle.tracks[DRIVE].enabled_at = self.now
            self.summaries.look(self.now, self.bridge)
        return " ".join(self.oracle.violations)


@pytest.fixture
def scene() -> Scene:
    found = Scene()
    assert not found.later(1.0)
    return found


@pytest.mark.parametrize("said", [{NODE: 2}, {NODE: 2, BUS: 2}, {NODE: 3, BUS: 2, ALL: 3}])
def test_a_whole_is_as_bad_as_the_worst_in_it(scene: Scene, said: dict[str, float | None]) -> None:
    scene.bridge.said = said
    assert "a whole is said to be better than the worst in it" in scene.later(0.25)


def test_what_has_no_value_yet_is_not_judged(scene: Scene) -> None:
    scene.bridge.said = {NODE: 2, ALL: None}
    assert not scene.later(0.25)


@pytest.mark.parametrize(("least", "condition"), [(ALARM, 1), (DANGER, 2)])
def test_what_is_wrong_is_shown(scene: Scene, least: int, condition: float) -> None:
    scene.summaries.wrong(DRIVE.node, least, scene.now, scene.now, scene.now + 10.0, "it burns")
    scene.bridge.said = dict.fromkeys((NODE, BUS, ALL), condition)
    assert not scene.later(1.0)
    assert f"{NODE} is said to be {condition}, and it burns" in scene.later(1.0)


@pytest.mark.parametrize("how", ["shown", "over", "disturbed", "not so"])
def test_nothing_is_demanded_of_what_is(scene: Scene, how: str) -> None:
    until = scene.now + (0.5 if how == "over" else 10.0)
    is_so = how != "not so"
    scene.summaries.wrong(DRIVE.node, ALARM, scene.now, scene.now, until, "it burns", lambda: is_so)
    if how == "shown":
        scene.bridge.said = dict.fromkeys((NODE, BUS, ALL), 2)
    if how == "disturbed":
        scene.summaries.disturbed(scene.now + 0.1)
    assert not scene.later(5.0)


def test_a_silent_node_is_an_alarm(scene: Scene) -> None:
    scene.summaries.silenced(DRIVE.node, scene.now, 10.0, lambda: True)
    assert f"{DRIVE.node} says nothing" in scene.later(LATER_S + 1.0)


def test_a_silent_controller_is_an_alarm(scene: Scene) -> None:
    family = DRIVE.family
    for word in (family.ready, family.run):
        scene.oracle.telegram(DRIVE, scene.now, word)
    scene.oracle.frame(scene.now, DRIVE.rpdo, family.run.to_bytes(2, "little") + bytes(2), of_bridge=True)
    timeout_s = PLANT.fieldbus_timeout_ms / 1000
    assert not scene.later(timeout_s + 1.0)
    found = scene.later(2.0)
    assert DRIVE.reaction == "hold" or f"the controller of {DRIVE.path} is silent" in found


def test_everything_is_in_order_again(scene: Scene) -> None:
    scene.summaries.busy(scene.now)
    scene.bridge.said = dict.fromkeys((BUS, ALL), 1)
    assert not scene.later(6.0, runs=True)
    assert "everything is in order" in scene.later(3.0, runs=True)


@pytest.mark.parametrize("how", ["an intruder", "a drive that stands", "one that runs untold"])
def test_or_it_is_not(scene: Scene, how: str) -> None:
    if how == "an intruder":
        scene.summaries.intruded(scene.now)
    scene.bridge.said = dict.fromkeys((BUS, ALL), 1)
    assert not scene.later(20.0, runs=how != "a drive that stands", is_told=how == "an intruder")


def cut(scene: Scene) -> None:
    scene.summaries.cut(scene.now, 5.0, lambda: True)
    scene.bridge.said = dict.fromkeys((BUS, ALL), 2)


def test_a_cut_bus_explains_all(scene: Scene) -> None:
    cut(scene)
    scene.bridge.lines = [("bus_silent", "bus/can0")]
    assert not scene.later(14.0)


@pytest.mark.parametrize("before", [0.0, 5.5])
def test_what_stands_beside_it_for_long_is_wrong(scene: Scene, before: float) -> None:
    cut(scene)
    scene.bridge.lines = [("bus_silent", "bus/can0")]
    assert not scene.later(before + 1.0)
    scene.bridge.lines.append(("node_lost", DRIVE.node))
    assert not scene.later(2.0)
    assert "stands beside it" in scene.later(1.0)


def test_a_cut_bus_has_to_be_called_silent(scene: Scene) -> None:
    cut(scene)
    assert "is not said to be silent" in scene.later(LATER_S + 0.5)


def test_beside_something_else_it_explains_nothing(scene: Scene) -> None:
    cut(scene)
    scene.summaries.busy(scene.now)
    scene.bridge.lines = [("node_lost", DRIVE.node)]
    assert not scene.later(14.0)
