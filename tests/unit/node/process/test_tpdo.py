"""TPDOs of a node itself: the values that they bring, until when nobody need ask, and odd lengths."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import pytest

from bridge.canopen.frame import Frame
from bridge.canopen.habits import HabitCounter
from bridge.canopen.pdo import PdoCodec, PdoEntry
from bridge.command import EventQueue
from bridge.node.boot import NodePdoPlan, PdoPlan
from bridge.node.process.polling import Polling
from bridge.node.process.tpdo import node_tpdos
from bridge.node.process.unfit_frames import UnfitFrames


class Shown:
    def __init__(
        self, kind: int = 255, event_ms: int = 0, names: tuple[str, ...] = ("temperature", "")
    ) -> None:
        codec = PdoCodec((PdoEntry(0x2000, 1, 16), PdoEntry(0x2000, 2, 8)))
        plan = PdoPlan(0x385, kind, event_ms, codec, (None, None))
        self.shown: list[tuple[str, int, float, float]] = []
        self._events = EventQueue()
        unfit = UnfitFrames("io", self._events, HabitCounter(), None)
        polling = cast(Polling, SimpleNamespace(on_pdo=self._show))
        self.routes = node_tpdos([NodePdoPlan(plan, ("temperature", ""))], 10, polling, unfit)

    @property
    def rejected(self) -> list[str]:
        return [event.message.rpartition(": ")[2] for event in self._events.waiting]

    def _show(self, name: str, value: int, at: float, until: float) -> None:
        self.shown.append((name, value, at, until))

    def comes(self, data: str) -> None:
        self.routes[0x385](Frame(0x385, bytes.fromhex(data), 10.0))


def test_a_value_with_a_name_is_shown_and_the_others_are_not() -> None:
    case = Shown()
    case.comes("2A0007")
    assert case.shown == [("temperature", 42, 10.0, float("inf"))]
    assert list(case.routes) == [0x385]


@pytest.mark.parametrize(("kind", "event_ms"), [(255, 100), (1, 0)])
def test_one_that_comes_regularly_is_believed_until_it_is_overdue(kind: int, event_ms: int) -> None:
    case = Shown(kind, event_ms)
    case.comes("2A0007")
    (_, _, at, until) = case.shown[0]
    assert at == 10.0
    assert 10.0 < until < 11.0


def test_one_that_is_too_long_is_rejected_and_read_and_one_too_short_is_rejected() -> None:
    case = Shown()
    case.comes("2A000700")
    assert case.rejected == ["3 bytes are mapped"]
    assert len(case.shown) == 1
    case.comes("2A00")
    assert len(case.rejected) == 2
    assert len(case.shown) == 1
