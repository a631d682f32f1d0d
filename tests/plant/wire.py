"""A CAN bus with arbitration and bit time, and the kernel's side of the bridge's end of it."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from functools import partial
from random import Random
from typing import Final

from bridge.can.burstend import Burst
from bridge.can.interface import BusStatus, ControllerState
from bridge.can.kernelbursts import KernelBursts
from bridge.can.wirebits import longest_bits
from bridge.canopen.frame import REMOTE, STANDARD_MASK, Frame
from tests.plant.machine import Process
from tests.plant.world import Timer, World
from tests.support.broadcast_manager import BroadcastManager

_MOST_BYTES: Final = 8
_MOST_WAITING: Final = 64
"""Frames in the queue of one controller: what comes beyond them is lost, as in the kernel's."""
_DOWN: Final = (ControllerState.DOWN, ControllerState.BUS_OFF)


class Port:
    """One controller on the wire. ``take`` gets what others send."""

    def __init__(self, wire: Wire, name: str, take: Callable[[Frame], None]) -> None:
        self._wire = wire
        self.name = name
        self.take = take
        self.sent: Callable[[Frame], None] = lambda frame: None
        """Called with each frame of its own that has been on the wire."""
        self.waiting: deque[Frame] = deque()
        self.is_off = False
        """It neither sends nor hears anything."""

    def send(self, frame: Frame) -> None:
        if not self.is_off and len(self.waiting) < _MOST_WAITING:
            self.waiting.append(frame)
            self._wire.begin()


class Wire:
    """The medium. ``witness`` gets each frame at the end of its transmission, with the port that sent it;
    ``loss`` is the share that no other port hears; while it ``is_cut`` the bridges' ports and the others do
    not hear each other."""

    def __init__(self, world: World, name: str, bitrate: int, rng: Random) -> None:
        self._world = world
        self.name = name
        self._times_s = [longest_bits(length) / bitrate for length in range(_MOST_BYTES + 1)]
        """How long a frame with so many bytes has the wire."""
        self._rng = rng
        self._ports: list[Port] = []
        self._is_busy = False
        self.witness: list[Callable[[Frame, Port], None]] = []
        self.loss = 0.0
        self.is_cut = False
        self.frames = 0

    def port(self, name: str, take: Callable[[Frame], None]) -> Port:
        port = Port(self, name, take)
        self._ports.append(port)
        return port

    def begin(self) -> None:
        """Let the lowest identifier that waits have the wire."""
        if self._is_busy:
            return
        winner, lowest = None, STANDARD_MASK + 1
        for port in self._ports:
            if port.waiting:
                can_id = port.waiting[0].can_id & STANDARD_MASK
                if can_id < lowest:
                    winner, lowest = port, can_id
        if winner is None:
            return
        frame = winner.waiting.popleft()
        self._is_busy = True
        length = 0 if frame.can_id & REMOTE else len(frame.data)
        self._world.after(self._times_s[length], partial(self._end, winner, frame))

    def _end(self, sender: Port, frame: Frame) -> None:
        if not sender.is_off:
            self.frames += 1
            frame = Frame(frame.can_id, frame.data, self._world.now)
            for tell in self.witness:
                tell(frame, sender)
            is_lost = self.loss > 0 and self._rng.random() < self.loss
            for port in () if is_lost else self._ports:
                if (
                    port is not sender
                    and not port.is_off
                    and (not self.is_cut or self._reaches(sender, port))
                ):
                    port.take(frame)
            sender.sent(frame)
        # Whoever answers at once takes part in the next arbitration.
        self._is_busy = False
        self.begin()

    def _reaches(self, sender: Port, port: Port) -> bool:
        return sender.name.startswith("bridge") == port.name.startswith("bridge")


class _Manager:
    """A socket of the kernel's broadcast manager. ``told`` is called when it has other bursts."""

    def __init__(self, kernel: BroadcastManager, told: Callable[[], None]) -> None:
        self._kernel = kernel
        self._told = told

    def send(self, message: bytes, /) -> int:
        taken = self._kernel.send(message)
        self._told()
        return taken

    def close(self) -> None:
        self._kernel.close()
        self._told()


class PlantBus:
    """The bridge's end of a wire, as ``bridge.can.interface.Bus`` has it: the real bursts above a model of
    the kernel, which goes on while the process stands still."""

    def __init__(self, world: World, wire: Wire, process: Process, name: str) -> None:
        self._world = world
        self._process = process
        self.name = wire.name
        self.status = BusStatus()
        self._port = wire.port(f"bridge {name}", self._take)
        self._port.sent = self._echo
        self._accepted: frozenset[int] = frozenset()
        self._ours: frozenset[int] = frozenset()
        self._inbox: list[Frame] = []
        self._foreign: list[Frame] = []
        self._of_bursts: set[int] = set()
        self._is_woken = False
        self._wake: Callable[[], None] = lambda: None
        self._kernel = BroadcastManager(lambda: world.now, self._from_kernel)
        self._kernel_timer: Timer | None = None
        self._bursts = KernelBursts(process.clock)
        self._bursts.open(_Manager(self._kernel, self._arm))

    # the kernel

    def _arm(self) -> None:
        due = self._kernel.next_deadline()
        timer = self._kernel_timer
        if timer is not None:
            if timer.act is not None and timer.at == due:
                return
            timer.cancel()
        self._kernel_timer = None if due is None else self._world.at(due, self._on_kernel_time)

    def _on_kernel_time(self) -> None:
        self._kernel.on_time()
        self._arm()

    def _from_kernel(self, frame: Frame) -> None:
        self._of_bursts.add(frame.can_id)
        self._port.send(frame)

    def _echo(self, frame: Frame) -> None:
        """A frame of a burst comes back where its identifier is accepted."""
        if frame.can_id in self._accepted and frame.can_id in self._of_bursts:
            self._inbox.append(frame)
            self._rouse()

    def _take(self, frame: Frame) -> None:
        if frame.can_id & STANDARD_MASK in self._accepted:
            self._inbox.append(frame)
            self._rouse()
        if frame.can_id in self._ours:
            self._foreign.append(frame)
            self._rouse()

    def _rouse(self) -> None:
        if not self._is_woken:
            self._is_woken = True
            # Not within the end of a frame: the wire goes on while the process stands still in this turn.
            self._world.after(0.0, lambda: self._process.post(self._wake_up))

    def _wake_up(self) -> None:
        self._is_woken = False
        if self._inbox or self._foreign:
            self._wake()

    def end_kernel(self) -> None:
        """The process has ended: its sockets are closed, and so are its bursts."""
        self._kernel.close()
        self._arm()
        self._port.waiting.clear()
        self._accepted = self._ours = frozenset()

    def enter(self, state: ControllerState) -> None:
        """The controller is in this state now, and nothing that waits is sent afterwards. The process sees it
        in its next turn."""
        self._port.is_off = state in _DOWN
        if self._port.is_off:
            self._port.waiting.clear()
        self._process.post(lambda: self._enter(state))

    def _enter(self, state: ControllerState) -> None:
        if state in _DOWN and self.status.state not in _DOWN:
            self.status.outages += 1
            self._bursts.end_all(self._world.now)
        self.status.state = state
        self._wake()

    # Bus

    def open(self, wake: Callable[[], None]) -> None:
        self._wake = wake

    def accept(self, can_ids: list[int]) -> None:
        self._accepted = frozenset(can_ids)

    def watch(self, can_ids: frozenset[int]) -> None:
        self._ours = can_ids

    def take_foreign(self, now: float, *, at_once: bool = False) -> list[Frame]:
        frames, self._foreign = self._foreign, []
        return frames

    def drain(self, now: float) -> list[Frame]:
        frames, self._inbox = self._inbox, []
        self.status.frames_received += len(frames)
        return frames

    def send(self, frame: Frame, now: float, deadline: float) -> None:
        if self.status.state in _DOWN:
            self.status.frames_expired += 1
        else:
            self._port.send(frame)

    def burst(self, burst: Burst, now: float, *, at_once: bool = False) -> None:
        if self.status.state in _DOWN:
            return
        frame = self._bursts.start(burst, now, at_once=at_once)
        if frame is not None:
            self.send(frame, now, now)

    def end_burst(self, can_id: int) -> None:
        self._bursts.end(can_id, self._world.now)

    def next_deadline(self) -> float | None:
        return self._bursts.next_deadline()

    def on_time(self, now: float) -> None:
        for frame in self._bursts.on_time(now):
            self.send(frame, now, now)

    def close(self) -> None:
        self._bursts.close()
