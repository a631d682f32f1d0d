"""The watch over what others send on our identifiers: when it looks, and what it gives."""

from __future__ import annotations

import socket
import struct
from collections.abc import Collection, Iterator
from typing import cast

import pytest

from bridge.can.cansockets import CanSockets
from bridge.can.foreignwatch import LOOK_S, ForeignWatch
from bridge.canopen.frame import Frame

CAN_FRAME = struct.Struct("=IB3x8s")
OURS = frozenset((0x205, 0x080))


class Pair:
    """A pair of sockets in place of an interface; it notes which identifiers are let in."""

    def __init__(self) -> None:
        self.bus, self.ours = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.ours.setblocking(False)
        self.let: list[frozenset[int]] = []

    def watching(self, can_ids: Collection[int]) -> socket.socket:
        self.let.append(frozenset(can_ids))
        return self.ours

    def let_in(self, can_ids: Collection[int], watching: socket.socket) -> None:
        assert watching is self.ours
        self.let.append(frozenset(can_ids))

    def others_send(self, *frames: Frame) -> None:
        for frame in frames:
            self.bus.send(CAN_FRAME.pack(frame.can_id, len(frame.data), frame.data))


@pytest.fixture
def pair() -> Iterator[Pair]:
    pair = Pair()
    yield pair
    pair.bus.close()
    pair.ours.close()


@pytest.fixture
def watch(pair: Pair) -> ForeignWatch:
    watch = ForeignWatch(cast("CanSockets", pair))
    watch.watch(OURS)
    watch.open(10.0)
    return watch


def test_it_looks_a_hundred_times_a_second(watch: ForeignWatch, pair: Pair) -> None:
    assert watch.next_deadline() == pytest.approx(10.01)
    pair.others_send(Frame(0x205, b"\x0f"))
    assert watch.take(10.005) == []
    assert [frame.data for frame in watch.take(10.01)] == [b"\x0f"]


def test_who_cannot_wait_gets_what_is_there_at_once(watch: ForeignWatch, pair: Pair) -> None:
    pair.others_send(Frame(0x205, b"\x0f"))
    assert len(watch.take(10.001, at_once=True)) == 1


def test_while_somebody_is_there_it_looks_five_times_as_often_for_a_second(
    watch: ForeignWatch, pair: Pair
) -> None:
    pair.others_send(Frame(0x080))
    watch.take(10.01)
    assert watch.next_deadline() == pytest.approx(10.012)
    watch.take(11.02)
    assert watch.next_deadline() == pytest.approx(11.02 + LOOK_S)


def test_what_the_filter_lets_in_beside_is_left_out(watch: ForeignWatch, pair: Pair) -> None:
    pair.others_send(Frame(0x206), Frame(0x205), Frame(0x081))
    assert [frame.can_id for frame in watch.take(10.5)] == [0x205]
    assert 0x205 in watch
    assert 0x206 not in watch


def test_other_identifiers_are_let_in_once(watch: ForeignWatch, pair: Pair) -> None:
    assert pair.let == [OURS]
    watch.watch(OURS)
    watch.watch(frozenset((0x305,)))
    assert pair.let == [OURS, {0x305}]


def test_nothing_is_looked_at_without_identifiers_or_a_socket(pair: Pair) -> None:
    watch = ForeignWatch(cast("CanSockets", pair))
    assert watch.next_deadline() is None
    watch.open(10.0)
    assert watch.next_deadline() is None, "no identifiers"
    watch.watch(OURS)
    assert watch.next_deadline() is not None
    watch.close()
    assert watch.next_deadline() is None
    assert watch.take(20.0, at_once=True) == []
