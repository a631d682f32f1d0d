"""A front of a plant: what its clients ask and read, while it runs, hangs and is gone."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from bridge.command import Identity, Outcome, Request, Role, Source, Write
from tests.plant.plan import Plan
from tests.plant.plant import Plant, project
from tests.proof.drives import DRIVES

DRIVE = next(drive for drive in DRIVES if drive.protocol == "opcua")
WORD = f"{DRIVE.path}/command/control_word"
STATUS = f"{DRIVE.path}/status/drive_status_word"


class Scene:
    """A plant in which nothing happens by itself, from 8 s on. Its drive of OPC UA moves."""

    def __init__(self, folder: Path) -> None:
        self.plant = Plant(project(folder), Plan(1, 60.0, ()))
        self.front = self.plant.front
        self.answers: list[Outcome] = []
        self.passes(8.0)

    def passes(self, seconds: float) -> None:
        self.plant.world.run_until(self.plant.world.now + seconds)

    def writes(self, word: int) -> None:
        """By the session that has the drive."""
        name = f"controller {DRIVE.place}"
        who = Identity(Source.OPCUA, name, Role.OPERATOR, connection=f"session {DRIVE.place}")
        request = Request(who, DRIVE.path, Write({"control_word": word}))
        self.front.ask(request, 0.001, lambda: None, self.answers.append)

    @property
    def number(self) -> float | None:
        return self.front.good_number(STATUS)


@pytest.fixture
def scene(tmp_path: Path) -> Iterator[Scene]:
    scene = Scene(tmp_path)
    yield scene
    scene.plant.close()
    assert not scene.plant.bridge.faults


def test_the_front_reads_what_the_drive_says(scene: Scene) -> None:
    mask, value = DRIVE.family.enabled
    assert scene.number is not None
    assert int(scene.number) & mask == value


def test_after_the_answer_it_reads_what_was_written(scene: Scene) -> None:
    for controller in scene.plant.controllers:
        controller.is_silent = True
    scene.writes(DRIVE.family.ready)
    while not scene.answers:
        scene.passes(0.0005)
    assert [one.ok for one in scene.answers] == [True]
    assert scene.front.good_number(WORD) == DRIVE.family.ready


def test_while_it_hangs_nothing_is_answered_and_what_waited_too_long_does_not_count(scene: Scene) -> None:
    scene.front.process.hang(0.9, in_turn=False)
    scene.writes(DRIVE.family.run)
    scene.passes(0.8)
    assert scene.answers == []
    assert scene.number is None
    scene.passes(0.2)
    assert [one.code.value for one in scene.answers] == ["stale"]
    scene.passes(0.3)
    assert scene.number is not None


def test_a_front_that_is_killed_answers_nothing_and_a_new_one_does(scene: Scene) -> None:
    lost: list[int] = []
    scene.front.on_lost.append(lost.append)
    scene.writes(DRIVE.family.run)
    scene.passes(0.001)
    scene.front.process.kill(in_turn=False)
    scene.passes(0.5)
    assert len(lost) == 1
    assert scene.answers == []
    assert scene.number is None
    scene.front.start()
    scene.passes(0.5)
    assert scene.number is not None
    scene.writes(DRIVE.family.run)
    scene.passes(0.1)
    assert len(scene.answers) == 1


def test_it_says_nothing_good_of_a_bus_process_that_hangs(scene: Scene) -> None:
    scene.plant.bridge.process.hang(3.0, in_turn=False)
    scene.passes(0.9)
    assert scene.number is not None
    scene.passes(0.3)
    assert scene.number is None
    scene.passes(3.0)
    assert scene.number is not None
