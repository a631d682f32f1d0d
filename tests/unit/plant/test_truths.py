"""What the image says is compared with what drives do, and a change that is not told is found."""

from __future__ import annotations

from collections.abc import Callable
from math import nan

import pytest

from bridge.canopen.frame import Frame
from bridge.command import Event, EventKind
from bridge.text import Text
from tests.plant.oracle import Oracle
from tests.plant.physics import Leaf, Physics
from tests.plant.truths import FOUND_S, Truths
from tests.plant.world import World
from tests.proof.drives import DRIVES

PATH = DRIVES[0].path


class Motor(Physics):
    """One whose speed is its word times its scale."""

    leaves = (
        Leaf("actual/speed", 0.1, ("scale",)),
        Leaf("command/speed", 0.1, ("scale",)),
        Leaf("actual/reached", 0.5, ("mode",), at_once=True, is_bit=True),
        Leaf("actual/current", 0.1, ("limit",), given="limit"),
    )

    def __init__(self) -> None:
        self.set_to: dict[str, float] = {"scale": 50.0, "mode": 2.0, "limit": 10.0}
        self.speed: float | None = 25.0
        self.set_speed: float | None = 25.0
        self.reached = 1.0
        self.current = 5.0

    def settings(self) -> dict[str, float]:
        return dict(self.set_to)

    def values(self) -> tuple[float | None, ...]:
        return self.speed, self.set_speed, self.reached, self.current


class Scene:
    """A drive that sends a telegram each 0.3 s, and an image that says what a test wants."""

    def __init__(self) -> None:
        self.world = World()
        self.oracle = Oracle([DRIVES[0]])
        self.motor = Motor()
        self.image: dict[str, float] = {}
        self.truths = Truths(
            self.oracle, lambda name: self.image.get(name.removeprefix(f"{PATH}/")), self.world
        )
        self._compose: Callable[[Frame], None] = self.truths.watch(PATH, self.motor)
        self.speaks = True
        self.run(10.0)

    def run(self, seconds: float) -> list[str]:
        for _ in range(round(seconds / 0.25)):
            self.world.run_until(self.world.now + 0.25)
            if self.speaks:
                self._compose(Frame(DRIVES[0].tpdo, bytes(8)))
            self.truths.look(self.world.now)
        return self.oracle.violations

    def begin_anew(self) -> None:
        self._compose(Frame(0x700 + DRIVES[0].node_id, b"\0"))

    def tell(self, message: str, kind: EventKind = EventKind.CONFIGURATION) -> None:
        self.truths.told(Event(self.world.now, kind, PATH, 500, Text.plain(message)))


@pytest.fixture
def scene() -> Scene:
    return Scene()


def test_what_is_so_may_be_said(scene: Scene) -> None:
    scene.image = {"actual/speed": 25.0, "command/speed": 25.05, "actual/reached": 1.0, "actual/current": 5.0}
    assert not scene.run(3.0)


@pytest.mark.parametrize("name", ["actual/speed", "command/speed"])
def test_what_is_not_so_is_found(scene: Scene, name: str) -> None:
    scene.image = {name: 23.75}
    found = scene.run(3.0)
    assert f"{PATH}/{name} is said to be 23.75, and the drive has 25" in found[0]


def test_a_value_may_be_as_old_as_a_telegram(scene: Scene) -> None:
    scene.image = {"actual/speed": 25.0}
    scene.motor.speed = 30.0
    assert not scene.run(0.5)
    assert scene.run(3.0)


def test_a_value_that_nothing_carries_is_none(scene: Scene) -> None:
    scene.image = {"actual/speed": 25.0}
    scene.motor.speed = None
    assert "the drive has no such value" in scene.run(3.0)[0]


def test_what_may_be_anything_is_not_judged(scene: Scene) -> None:
    scene.image = {"command/speed": 1.0}
    scene.motor.set_speed = nan
    assert not scene.run(3.0)


def test_a_set_value_may_be_on_its_way(scene: Scene) -> None:
    scene.image = {"command/speed": 10.0}
    scene.run(1.0)
    scene.image = {"command/speed": 25.0}
    assert not scene.run(3.0)


def test_a_stop_may_not_reach_the_drive(scene: Scene) -> None:
    scene.image = {"command/speed": 0.0}
    assert not scene.run(3.0)


def test_a_bit_that_is_not_set_says_nothing(scene: Scene) -> None:
    scene.image = {"actual/reached": 0.0}
    assert not scene.run(3.0)
    scene.image, scene.motor.reached = {"actual/reached": 1.0}, 0.0
    assert scene.run(3.0)


def test_a_change_has_its_time_to_be_found(scene: Scene) -> None:
    scene.image = {"actual/speed": 25.0}
    scene.motor.set_to["scale"], scene.motor.speed = 100.0, 50.0
    assert not scene.run(FOUND_S - 1.0)
    assert "is said to be 25, and the drive has 50" in scene.run(3.0)[0]


def test_what_a_telegram_says_by_itself_has_none(scene: Scene) -> None:
    scene.image = {"actual/reached": 1.0}
    scene.motor.set_to["mode"], scene.motor.reached = 3.0, 0.0
    assert scene.run(3.0)


@pytest.mark.parametrize("is_told", [False, True])
def test_a_change_is_told(scene: Scene, is_told: bool) -> None:
    scene.motor.set_to["scale"], scene.motor.speed = 100.0, 50.0
    scene.run(5.0)
    scene.tell("scale of parameter set 1 is 100, it was 50" if is_told else "mode is 3, it was 2")
    scene.image = {"actual/speed": 50.0}
    found = scene.run(FOUND_S)
    assert bool(found) is not is_told
    if found:
        assert f"{PATH}: scale was changed at 10.250 s, and no event says so" in found[0]


def test_a_change_may_be_told_before_the_next_telegram(scene: Scene) -> None:
    scene.motor.set_to["scale"], scene.motor.speed = 100.0, 50.0
    scene.tell("scale of parameter set 1 is 100, it was 50")
    scene.image = {"actual/speed": 50.0}
    assert not scene.run(FOUND_S + 2.0)


def test_a_change_that_leaves_nothing_good_need_not_be_told(scene: Scene) -> None:
    scene.motor.set_to["scale"] = 100.0
    assert not scene.run(FOUND_S + 2.0)


def test_one_that_is_undone_need_not_be_told(scene: Scene) -> None:
    scene.image = {"actual/speed": 25.0}
    scene.motor.set_to["scale"] = 100.0
    scene.run(3.0)
    scene.motor.set_to["scale"] = 50.0
    assert not scene.run(FOUND_S + 2.0)


@pytest.mark.parametrize("what", ["disturbed", "silent", "node restarted"])
def test_one_that_is_read_anew_need_not_be_told(scene: Scene, what: str) -> None:
    scene.motor.set_to["scale"], scene.motor.speed = 100.0, 50.0
    scene.run(3.0)
    if what == "disturbed":
        scene.truths.disturbed(scene.world.now)
    elif what == "node restarted":
        scene.begin_anew()
    else:
        scene.speaks = False
        scene.run(2.0)
        scene.speaks = True
    scene.image = {"actual/speed": 50.0}
    assert not scene.run(FOUND_S + 2.0)


def test_what_the_site_file_gives_counts_while_it_is_what_the_drive_has(scene: Scene) -> None:
    """A bridge that begins beside a drive that was changed cannot know it."""
    scene.motor.set_to["limit"], scene.motor.current = 20.0, 10.0
    scene.run(0.5)
    scene.truths.started()
    scene.truths.disturbed(scene.world.now)
    scene.image = {"actual/current": 5.0}
    assert not scene.run(FOUND_S + 3.0)
    scene.motor.set_to["limit"], scene.motor.current = 10.0, 5.0
    scene.tell("limit is 10, it was 20")
    scene.run(FOUND_S + 3.0)
    scene.motor.set_to["limit"], scene.motor.current = 20.0, 10.0
    assert "actual/current is said to be 5" in scene.run(FOUND_S + 3.0)[-1]
