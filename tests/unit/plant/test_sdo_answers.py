"""SDO answers that are late, wrong, or not there."""

from __future__ import annotations

import pytest

from bridge.canopen.frame import Frame
from tests.plant.sdo_answers import LATE, SdoAnswers
from tests.plant.world import BEGIN_S, World

UPLOAD = Frame(0x585, bytes.fromhex("4B 69 20 01 F4 01 00 00"))
SEGMENT = Frame(0x585, bytes.fromhex("01 61 62 63 64 65 66 67"))


def answered(how: str, frame: Frame = UPLOAD) -> list[tuple[float, str]]:
    world = World()
    sent: list[tuple[float, str]] = []
    answers = SdoAnswers(world, 5, lambda one: sent.append((world.now - BEGIN_S, one.data.hex())))
    answers.how = how
    answers.on_answer(frame)
    world.run_until(BEGIN_S + 2.0)
    return sent


@pytest.mark.parametrize("how", LATE)
def test_one_that_is_late_is_the_same(how: str) -> None:
    assert answered(how) == [(pytest.approx(float(how)), UPLOAD.data.hex())]


def test_one_that_is_refused_names_its_object() -> None:
    assert answered("aborts") == [(0.0, "8069200100000008")]


def test_one_about_another_object_does_not() -> None:
    assert answered("another index") == [(0.0, "4b6820010b010000")]
    assert answered("another index", SEGMENT) == [(0.0, SEGMENT.data.hex())], "it names none"


def test_one_may_not_come_at_all() -> None:
    assert answered("silent") == []


def test_those_of_every_channel_are_known() -> None:
    """BU 2500 §6.4: SDO2 … SDO4 of a NORD interface."""
    assert {0x585, 0x2C5, 0x3C5, 0x4C5} <= SdoAnswers(World(), 5, lambda one: None).can_ids
