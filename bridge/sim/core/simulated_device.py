"""Base of all simulated drives: frames, time and power."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterable, Sequence

from bridge.canopen.frame import ERROR, EXTENDED, STANDARD_MASK, Frame
from bridge.sim.core.canopen_slave import Application, CanopenSlave
from bridge.sim.core.dictionary import Dictionary
from bridge.sim.core.habit import Rule
from bridge.sim.core.habit_player import HabitPlayer
from bridge.sim.core.ticks import earliest


class SimulatedDevice(Application):
    """The node as the CAN bus sees it, and the application of its CANopen slave. Times are seconds of the
    caller's monotonic clock.

    What is injected takes effect at the next ``on_time`` or ``on_frame``; ``next_deadline`` is due at once.
    """

    slave: CanopenSlave

    def __init__(self, node_id: int) -> None:
        self.node_id = node_id
        self.powered = False
        self.heard: frozenset[int] = frozenset()
        """The identifiers that ``on_frame`` evaluates at present."""
        self._now = 0.0
        self._injected: list[Callable[[], None]] = []
        self._due: float | None = None
        """Time at which ``_finish`` has something to do although nothing has changed."""
        self._is_steady = False
        """True if nothing has changed since time was last passed: a frame of the same moment need not do it
        again."""
        self._slave_hears: frozenset[int] | None = None
        """Identifiers of the slave for which ``heard`` was made."""
        self._habits: HabitPlayer | None = None

    # To be defined by the device.

    @abstractmethod
    def _switch_on(self) -> None:
        """Settings and process data are those of power-on."""

    @abstractmethod
    def _pass_time(self) -> None:
        """Bring the drives to the present time."""

    @abstractmethod
    def _receive(self, frame: Frame) -> None:
        """A frame that the node hears."""

    @abstractmethod
    def _deadlines(self) -> Iterable[float | None]:
        """Deadlines in addition to those of the slave."""

    def _finish(self) -> None:
        """Send what is due."""
        self.slave.poll(self._now)

    def _hears(self) -> frozenset[int]:
        return self.slave.hears()

    def _finish_due(self) -> float | None:
        """Time at which ``_finish`` has something to do although nothing has changed."""
        return self.slave.next_deadline()

    @property
    def dictionary(self) -> Dictionary:
        """The objects of the node itself, as its first SDO channel reaches them."""
        return self.slave.dictionary

    # The core: frames and time in, frames out.

    def start(self, now: float) -> None:
        """Power on."""
        self._now = now
        self._switch_on()
        self.powered = True
        self.slave.boot()
        self._due = None
        self._listen()

    def on_frame(self, frame: Frame, now: float) -> None:
        can_id = frame.can_id
        if not self.powered or can_id & STANDARD_MASK not in self.heard or can_id & (EXTENDED | ERROR):
            return
        if now > self._now or not self._is_steady or self._injected:
            self._advance(now)
        if self.powered:
            self._hear(frame)
            if self.slave.dirty.is_set or (self._due is not None and self._due <= self._now):
                self._conclude()
        if self.slave.hears() is not self._slave_hears:
            self._listen()
        self._pass_through_habits()

    def on_time(self, now: float) -> None:
        self._advance(now)
        if self.powered:
            self._conclude()
        self._pass_through_habits()

    def next_deadline(self) -> float | None:
        """Time at which ``on_time`` has to be called next, or None."""
        if self._injected:
            return self._now
        if not self.powered:
            return None
        held = self._habits.next_deadline() if self._habits else None
        return earliest(self._due, held, *self._deadlines())

    def take_frames(self) -> list[Frame]:
        """Frames that the node has to send, oldest first."""
        if self._habits is None:
            return self._sent()
        self._pass_through_habits()
        return self._habits.due(self._now)

    def _sent(self) -> list[Frame]:
        """Frames that the device itself has to send, oldest first."""
        return self.slave.take_frames()

    def _hear(self, frame: Frame) -> None:
        heard = self._habits.on_frame(frame, self._now) if self._habits else frame
        if heard is not None:
            self._receive(heard)

    def _pass_through_habits(self) -> None:
        """Not when the frames are fetched: until then nobody would know that some of them are held back."""
        if self._habits is not None:
            for frame in self._habits.put(self._sent(), self._now):
                self._receive(frame)

    def _advance(self, now: float) -> None:
        self._now = max(self._now, now)  # stamps of frames may lie before the last timer
        if self.powered:
            self._pass_time()
            self._is_steady = True
        if self._injected:
            injected, self._injected = self._injected, []
            for action in injected:
                action()
            self.slave.touch()

    def _conclude(self) -> None:
        self._finish()
        self._is_steady = not self.slave.dirty.is_set
        self.slave.dirty.is_set = False
        self._due = self._finish_due()

    def _listen(self) -> None:
        self._slave_hears = self.slave.hears()
        self.heard = self._hears()

    # What a test or a demonstration does to any node.

    def adopt_habits(self, rules: Sequence[Rule]) -> None:
        """Apply rules by which its frames differ from the standard from now on."""
        self._habits = HabitPlayer(self.node_id, rules)

    def silence(self) -> None:
        """The node sends nothing more; it goes on receiving and working."""
        self.slave.silent = True

    def speak(self) -> None:
        self.slave.silent = False

    def power_off(self) -> None:
        """Mains and 24 V off for the node and its drives."""

        def off() -> None:
            self.powered = False
            self.slave.power_off()
            if self._habits is not None:
                self._habits.clear()

        self._injected.append(off)

    def power_cycle(self) -> None:
        """Off and on again: unsaved settings are lost, the boot-up message comes."""
        self.power_off()
        self._injected.append(lambda: self.start(self._now))
