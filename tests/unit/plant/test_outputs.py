"""Outputs that somebody has stopped stay safe, and a bridge that keeps them so does nothing wrong."""

from __future__ import annotations

import pytest

from bridge.command import Code, Outcome
from tests.plant.oracle import REACTION_S, Oracle
from tests.plant.outputs import Outputs
from tests.proof.block import BLOCK
from tests.proof.drives import DRIVES

LATER_S = REACTION_S + 0.1


class Scene:
    """Outputs that are active, and that somebody has stopped at 1010 s."""

    def __init__(self, outcome: Outcome) -> None:
        self.oracle = Oracle([DRIVES[0]])
        self.outputs = Outputs(self.oracle)
        self.gets(1009.9, BLOCK.active)
        self.outputs.stopped(1010.0, 1010.0, outcome)

    def gets(self, at: float, values: bytes) -> list[str]:
        self.outputs.frame(at, BLOCK.rpdo, values)
        return self.oracle.violations


@pytest.fixture
def scene() -> Scene:
    found = Scene(Outcome(Code.OK))
    assert not found.oracle.violations
    return found


def test_what_is_stopped_is_safe(scene: Scene) -> None:
    assert not scene.gets(1010.0 + LATER_S, BLOCK.safe)


@pytest.mark.parametrize("values", [BLOCK.active, BLOCK.held])
def test_what_is_sent_on_is_wrong(scene: Scene, values: bytes) -> None:
    (text,) = scene.gets(1010.0 + LATER_S, values)
    assert f"get {values.hex()}" in text


def test_their_owner_takes_the_stop_back(scene: Scene) -> None:
    scene.outputs.free()
    assert not scene.gets(1010.0 + LATER_S, BLOCK.active)


def test_a_bridge_that_has_failed_is_excused(scene: Scene) -> None:
    scene.outputs.disturbed(1010.1)
    assert not scene.gets(1010.0 + LATER_S, BLOCK.active)


@pytest.mark.parametrize("outcome", [Outcome(Code.NOT_READY), Outcome(Code.OK, forwarded=False)])
def test_a_stop_is_forwarded(outcome: Outcome) -> None:
    (text,) = Scene(outcome).oracle.violations
    assert "a stop of outputs that are active is answered" in text


@pytest.mark.parametrize("is_reset", [False, True])
def test_one_that_cannot_be_is_kept_all_the_same(is_reset: bool) -> None:
    scene = Scene(Outcome(Code.OK))
    if is_reset:
        scene.outputs.frame(1010.1, 0x000, bytes((0x82, BLOCK.node_id)))
    came = 1010.15 if is_reset else 1012.0
    scene.outputs.stopped(came, came, Outcome(Code.OK, forwarded=False))
    assert not scene.oracle.violations
    (text,) = scene.gets(came + LATER_S, BLOCK.held)
    assert "outputs that somebody has stopped" in text
