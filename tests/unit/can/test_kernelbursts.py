"""Bursts in the kernel's broadcast manager: what is on the bus where the kernel refuses a message."""

from __future__ import annotations

import errno
import os
import struct

import pytest

from bridge.can.burstend import Burst
from bridge.can.kernelbursts import KernelBursts
from bridge.canopen.frame import Frame

RUN, STOP = Frame(0x205, bytes.fromhex("7F04")), Frame(0x205, bytes.fromhex("7E04"))
OTHER = Frame(0x305, b"\1")
PERIOD_S = 0.01
SETUP, DELETE = 1, 2
START = 2


class Kernel:
    """The broadcast manager's end of the socket: what it holds, and whether it takes messages now."""

    def __init__(self) -> None:
        self.now = 0.0
        self.refuses: int | None = None
        self.said: list[tuple[int, int, int]] = []
        self.holds: dict[int, bytes] = {}
        self.closed = False

    def send(self, message: bytes, /) -> int:
        if self.refuses:
            raise OSError(self.refuses, os.strerror(self.refuses))
        kind, flags, _, _, _, _, _, can_id, _ = struct.unpack_from("@IIIllllII", message)
        self.said.append((kind, flags, can_id))
        if kind == DELETE:
            self.holds.pop(can_id, None)
        else:
            assert flags & START or can_id in self.holds, "a refill wakes no burst"
            self.holds[can_id] = message[-8:]
        return len(message)

    def close(self) -> None:
        self.closed = True
        self.holds.clear()


@pytest.fixture
def kernel() -> Kernel:
    return Kernel()


@pytest.fixture
def beats(kernel: Kernel) -> KernelBursts:
    beats = KernelBursts(lambda: kernel.now)
    beats.open(kernel)
    assert beats.start(Burst((RUN,), PERIOD_S, 10), 0.0, at_once=True) is None
    assert beats.start(Burst((OTHER,), PERIOD_S, 10), 0.0, at_once=True) is None
    return beats


def control_word(kernel: Kernel) -> bytes:
    return kernel.holds[0x205][:2]


@pytest.mark.parametrize("number", [errno.EAGAIN, errno.ENOBUFS, errno.ENOMEM])
def test_a_stop_that_the_kernel_refuses_is_tried_again_a_millisecond_later(
    kernel: Kernel, beats: KernelBursts, number: int
) -> None:
    kernel.refuses = number
    assert beats.start(Burst((STOP,), PERIOD_S, 10), 0.02, at_once=True) is None
    assert control_word(kernel) == RUN.data
    assert beats.next_deadline() == pytest.approx(0.021)
    kernel.refuses = None
    assert beats.on_time(0.021) == []
    assert control_word(kernel) == STOP.data
    assert kernel.said[-1] == (SETUP, 1 | 8, 0x205), "sent at once, and the phase is kept"
    assert beats.next_deadline() is None


def test_the_newest_words_are_those_that_are_tried_again(kernel: Kernel, beats: KernelBursts) -> None:
    kernel.refuses = errno.ENOBUFS
    beats.start(Burst((RUN._replace(data=b"\xff\x04"),), PERIOD_S, 10), 0.02, at_once=True)
    beats.start(Burst((STOP,), PERIOD_S, 10), 0.0205, at_once=False)
    kernel.refuses = None
    beats.on_time(0.022)
    assert control_word(kernel) == STOP.data
    assert kernel.said[-1][1] & 8, "the change still goes out at once"


def test_a_burst_that_the_kernel_never_took_is_started_not_refilled(kernel: Kernel) -> None:
    beats = KernelBursts(lambda: kernel.now)
    beats.open(kernel)
    kernel.refuses = errno.ENOMEM
    beats.start(Burst((RUN,), PERIOD_S, 10), 0.0, at_once=True)
    kernel.refuses = None
    beats.on_time(0.001)
    assert control_word(kernel) == RUN.data


def test_a_burst_that_may_have_ended_while_its_renewal_was_on_its_way_is_started_anew(
    kernel: Kernel, beats: KernelBursts
) -> None:
    kernel.now = 0.0799
    beats.start(Burst((STOP,), PERIOD_S, 10), 0.079, at_once=True)
    assert kernel.said[-1] == (SETUP, 1 | 8, 0x205), "it runs: its phase is kept"
    kernel.now = 0.081
    beats.start(Burst((OTHER,), PERIOD_S, 10), 0.079, at_once=False)
    assert kernel.said[-3:] == [(SETUP, 1, 0x305), (DELETE, 0, 0x305), (SETUP, 1 | START, 0x305)]


def test_a_renewal_that_was_on_its_way_for_longer_than_its_burst_wakes_none(
    kernel: Kernel, beats: KernelBursts
) -> None:
    kernel.now = 0.02 + 10 * PERIOD_S
    beats.start(Burst((RUN,), PERIOD_S, 10), 0.02, at_once=True)
    assert kernel.said[-1] == (DELETE, 0, 0x205)
    beats.start(Burst((RUN,), PERIOD_S, 10), kernel.now, at_once=False)
    assert kernel.said[-1] == (SETUP, 1 | START, 0x205), "the next one does"


def test_a_kernel_that_goes_on_refusing_loses_every_burst_and_we_send_them(
    kernel: Kernel, beats: KernelBursts
) -> None:
    kernel.refuses = errno.ENOMEM
    beats.start(Burst((STOP,), PERIOD_S, 10), 0.02, at_once=True)
    now, sent = 0.02, list[Frame]()
    while not beats.refusal:
        deadline = beats.next_deadline()
        assert deadline is not None
        now = deadline
        sent += beats.on_time(now)
    assert now <= 0.02 + 0.0111, "the old word is on the bus for ten milliseconds at most"
    assert kernel.closed
    assert not kernel.holds
    assert sorted(frame.data for frame in sent) == sorted([STOP.data, OTHER.data]), "the new word, at once"
    assert beats.refusal == "Cannot allocate memory"
    assert sorted(f.can_id for f in beats.on_time(now + PERIOD_S)) == [0x205, 0x305]
    assert beats.start(Burst((RUN,), PERIOD_S, 10), now + 0.012, at_once=True) == RUN, "we send what changes"


def test_a_kernel_that_takes_bursts_again_gets_them_back_without_a_gap(
    kernel: Kernel, beats: KernelBursts
) -> None:
    kernel.refuses = errno.ENOMEM
    beats.start(Burst((STOP,), PERIOD_S, 10), 0.02, at_once=True)
    for ms in range(21, 33):
        beats.on_time(ms / 1000)
    assert beats.refusal
    again = Kernel()
    beats.open(again)
    again.refuses = errno.ENOMEM
    beats.start(Burst((STOP,), PERIOD_S, 10), 0.035, at_once=False)
    assert 0x205 in {frame.can_id for frame in beats.on_time(0.042)}, "until it takes it, we go on"
    again.refuses = None
    beats.on_time(0.0435)
    assert 0x205 in again.holds
    assert 0x205 not in {frame.can_id for frame in beats.on_time(0.06)}


def test_a_burst_that_is_silenced_while_its_renewal_waits_is_deleted(
    kernel: Kernel, beats: KernelBursts
) -> None:
    kernel.refuses = errno.ENOBUFS
    beats.start(Burst((STOP,), PERIOD_S, 10), 0.02, at_once=True)
    beats.end(0x205, 0.0205)
    kernel.refuses = None
    beats.on_time(0.022)
    assert kernel.said[-1] == (DELETE, 0, 0x205)
    assert list(kernel.holds) == [0x305]


def test_an_outage_ends_what_the_kernel_holds_even_after_a_refusal(
    kernel: Kernel, beats: KernelBursts
) -> None:
    kernel.refuses = errno.EAGAIN
    beats.start(Burst((STOP,), PERIOD_S, 10), 0.02, at_once=True)
    kernel.refuses = None
    beats.end_all(0.0205)
    assert not kernel.holds
    assert beats.next_deadline() is None


def test_a_deletion_that_is_refused_for_long_ends_the_bursts_by_closing(
    kernel: Kernel, beats: KernelBursts
) -> None:
    kernel.refuses = errno.ENOMEM
    beats.end(0x205, 0.02)
    sent = [frame for ms in range(21, 33) for frame in beats.on_time(ms / 1000)]
    assert kernel.closed
    assert {frame.can_id for frame in sent} == {0x305}, "who was silenced stays so"


@pytest.mark.parametrize("number", [errno.ENETDOWN, errno.ENODEV, errno.ENOTCONN])
def test_an_interface_that_is_gone_is_told(kernel: Kernel, beats: KernelBursts, number: int) -> None:
    kernel.refuses = number
    with pytest.raises(OSError):
        beats.start(Burst((STOP,), PERIOD_S, 10), 0.02, at_once=True)
    assert not beats.refusal
