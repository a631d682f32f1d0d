"""TPDOs of a device: which of its inputs they bring, within which time, and odd lengths."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.canopen.frame import Frame
from bridge.canopen.habits import HabitCounter
from bridge.canopen.pdo import PdoCodec, PdoEntry
from bridge.command import EventQueue
from bridge.command.drive_link import NodeState
from bridge.image import Quality
from bridge.node.boot import PdoPlan, SignalPlan
from bridge.node.process.inputs import connect_inputs
from bridge.node.process.unfit_frames import UnfitFrames
from tests.support.devices import ENCODER
from tests.support.nodes import device_plant


class Case:
    def __init__(self, folder: Path, kind: int = 255, event_ms: int = 100) -> None:
        self.plant = device_plant(folder, ENCODER)
        (device,) = self.plant.nodes["shaft"].devices
        device.on_node(NodeState.OPERATIONAL, 9.0)
        entries = (PdoEntry(0x6004, 0, 32), PdoEntry(0x0005, 0, 8))
        codec = PdoCodec(entries, {(0x6004, 0)})
        plan = PdoPlan(0x194, kind, event_ms, codec, (None, None), name="TPDO1")
        self._events = EventQueue()
        unfit = UnfitFrames("shaft", self._events, HabitCounter(), None)
        self.device = device
        self.routes = connect_inputs(device, SignalPlan([plan], {}), 10, unfit, 9.0)

    @property
    def rejected(self) -> list[str]:
        return [event.message.rpartition(": ")[2] for event in self._events.waiting]

    def comes(self, data: str, time: float = 10.0) -> None:
        self.routes[0x194](Frame(0x194, bytes.fromhex(data), time))

    @property
    def position(self):
        return self.plant.image.read("shaft/input/position")


@pytest.fixture
def case(tmp_path: Path) -> Case:
    return Case(tmp_path)


def test_an_input_is_shown_with_its_sign_scale_and_time(case: Case) -> None:
    assert list(case.routes) == [0x194]
    case.comes("24FAFFFF00")
    assert (case.position.value, case.position.quality, case.position.time) == (-1.5, Quality.GOOD, 10.0)
    assert case.rejected == []


def test_one_that_is_too_long_is_rejected_and_read_and_one_too_short_is_rejected(case: Case) -> None:
    case.comes("E80300000000")
    assert case.rejected == ["5 bytes are mapped"]
    assert case.position.value == 1.0
    case.comes("D007000000"[:8])
    assert len(case.rejected) == 2
    assert case.position.value == 1.0


@pytest.mark.parametrize(("kind", "event_ms", "has_deadline"), [(255, 100, True), (255, 0, False)])
def test_one_that_comes_regularly_has_its_time(
    tmp_path: Path, kind: int, event_ms: int, has_deadline: bool
) -> None:
    case = Case(tmp_path, kind, event_ms)
    case.comes("E803000000")
    assert (case.device.next_deadline() is not None) is has_deadline
