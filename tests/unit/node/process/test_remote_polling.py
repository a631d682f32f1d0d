"""TPDOs that come on a remote frame only (CiA 301 §7.5.2.37): who is asked, with what, and how often."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import pytest

from bridge.canopen.frame import REMOTE, Frame
from bridge.canopen.pdo import PdoCodec, PdoEntry
from bridge.node.boot import PdoPlan
from bridge.node.process.process_data import DrivePdos
from bridge.node.process.remote_polling import RemotePolling

REQUEST = Frame(0x185 | REMOTE, bytes(4))


def drive(kind: int, *, remote_allowed: bool = True, period_s: float = 0.5) -> DrivePdos:
    codec = PdoCodec((PdoEntry(0x6041, 0, 16), PdoEntry(0x6044, 0, 16)))
    plan = PdoPlan(0x185, kind, 0, codec, (None, None), remote_allowed)
    tpdo = SimpleNamespace(cob_id=0x185, plan=plan, rtr_poll_s=period_s)
    return cast("DrivePdos", SimpleNamespace(tpdos=[tpdo]))


@pytest.mark.parametrize("kind", [252, 253])
def test_a_request_is_as_long_as_the_answer(kind: int) -> None:
    polling = RemotePolling()
    polling.start([drive(kind)], 10.0)
    polling.on_time(10.0)
    assert polling.take_frames() == [REQUEST]
    assert polling.take_frames() == []


@pytest.mark.parametrize("kind", [0, 1, 240, 254, 255])
def test_other_types_come_by_themselves(kind: int) -> None:
    polling = RemotePolling()
    polling.start([drive(kind)], 10.0)
    assert polling.next_deadline() is None


def test_a_tpdo_that_must_not_be_asked_for_is_not() -> None:
    polling = RemotePolling()
    polling.start([drive(253, remote_allowed=False)], 10.0)
    polling.on_time(20.0)
    assert polling.take_frames() == []


def test_each_is_asked_in_its_own_period_and_once_by_a_round_that_is_late() -> None:
    polling = RemotePolling()
    polling.start([drive(253)], 10.0)
    asked: list[float] = []
    for now in (10.0, 10.25, 10.5, 10.75, 12.6, 12.61, 13.1):
        polling.on_time(now)
        asked += [now] * len(polling.take_frames())
    assert asked == [10.0, 10.5, 12.6, 13.1]


def test_after_the_end_nothing_is_asked() -> None:
    polling = RemotePolling()
    polling.start([drive(253)], 10.0)
    polling.on_time(10.0)
    polling.stop()
    assert polling.take_frames() == []
    assert polling.next_deadline() is None
