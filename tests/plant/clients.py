"""Controllers of a plant: a program for each drive that wants it to run, by Modbus TCP or as a client of
OPC UA or zenoh. Words and registers are those of the manuals and of docs/reference/modbus.md."""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Final, Protocol

from bridge.command import Action, Identity, Outcome, Request, Source, Write, command_of
from tests.plant.bridge_process import Bridge
from tests.plant.oracle import ALIVE, START
from tests.plant.stream import Stream
from tests.plant.world import Timer, World
from tests.proof.board import NUMBERS
from tests.proof.drives import Drive
from tests.proof.families import NORD, NORD_INVALID
from tests.proof.settings import PLANT

_HEAD: Final = struct.Struct(">HHHB")
_READ: Final = struct.Struct(">BHH")
_WRITE: Final = struct.Struct(">BHHB")
_READ_HOLDING, _READ_INPUT, _WRITE_HOLDING = 3, 4, 16
_EXCEPTION: Final = 0x80
_STATUS: Final = (9, 1)
"""Input register with the drive's own status word, and how many are read."""
_RELEASE, _ACKNOWLEDGE = 10, 11
_DELAY_S: Final = 0.002
_AGAIN_S: Final = 0.5
_SOURCES: Final = {"modbus": Source.MODBUS, "opcua": Source.OPCUA, "zenoh": Source.ZENOH}
_BEGINS: Final = ("ready", "acknowledge", "ready", "run", "run", "run", "run", "run")
"""Words of a controller whose drive does not move: it acknowledges whatever there is, and enables anew."""

_STARTS: Final = ("ready", "acknowledge", "ready", "start", *("alive",) * 8)
"""What one sends that starts it by a command, which takes up to 3 s."""

Arrived = Callable[[Drive, int], None]
"""Called when a telegram of the drive's controller, with this control word, reaches the bridge's machine."""

Refused = Callable[[Drive, int, float, int], None]
"""Called with the setpoint of a telegram that was to enable, when it was sent, and the exception that it
got."""


class Door(Protocol):
    """Where clients of OPC UA and zenoh ask: the bus process, or a front."""

    on_start: list[Callable[[], None]]

    def ask(
        self,
        request: Request,
        delay_s: float,
        arrived: Callable[[], None],
        reply: Callable[[Outcome], None],
    ) -> None: ...

    def connected(self, identity: Identity, *, is_there: bool) -> None: ...

    def good_number(self, name: str) -> float | None: ...


class Line:
    """A Modbus connection with requests one after the other, connected anew when it has ended."""

    def __init__(self, world: World, bridge: Bridge, host: str, arrived: Callable[[bytes], None]) -> None:
        self._world = world
        self._bridge = bridge
        self._host = host
        self._arrived = arrived
        self._answers: list[Callable[[bytes], None]] = []
        self._received = b""
        self._again: Timer | None = None
        self.stream: Stream | None = None
        self.is_wanted = True

    def connect(self) -> None:
        self._again = None
        if self.stream is not None or not self.is_wanted:
            return
        self._received = b""
        self._answers.clear()
        self.stream = self._bridge.connect(self._host, _DELAY_S, take=self._take, on_closed=self._closed)
        if self.stream is None:
            self._later()
        else:
            self.stream.arrived = self._arrived

    def _later(self) -> None:
        if self._again is None:
            self._again = self._world.after(_AGAIN_S, self.connect)

    def _closed(self) -> None:
        self.stream = None
        if self.is_wanted:
            self._later()

    def ask(self, unit: int, pdu: bytes, then: Callable[[bytes], None] = lambda pdu: None) -> None:
        if self.stream is not None:
            self._answers.append(then)
            self.stream.send(_HEAD.pack(1, 0, len(pdu) + 1, unit) + pdu)

    def _take(self, data: bytes) -> None:
        self._received += data
        while len(self._received) >= _HEAD.size:
            _, _, length, _ = _HEAD.unpack_from(self._received)
            end = 6 + length
            if len(self._received) < end:
                return
            pdu, self._received = self._received[_HEAD.size : end], self._received[end:]
            self._answers.pop(0)(pdu)

    def ask_often(self, unit: int, pdu: bytes, times: int) -> None:
        """The same request so many times, without waiting for an answer."""
        if self.stream is not None:
            self._answers += [lambda pdu: None] * times
            self.stream.send((_HEAD.pack(1, 0, len(pdu) + 1, unit) + pdu) * times)

    def leave(self) -> None:
        """Close the connection for good, as a program that ends does."""
        self.is_wanted = False
        if self.stream is not None:
            self.stream.send(b"")
            self.stream.forget()
            self.stream = None


def writes(register: int, *words: int) -> bytes:
    return _WRITE.pack(_WRITE_HOLDING, register, len(words), 2 * len(words)) + struct.pack(
        f">{len(words)}H", *words
    )


def read(register: int, count: int) -> bytes:
    """Request for holding registers."""
    return _READ.pack(_READ_HOLDING, register, count)


class Controller:
    """The program that owns one drive. It writes a telegram in each period, with a number in its setpoint,
    and looks whether the drive moves."""

    def __init__(
        self, world: World, bridge: Bridge, door: Door, drive: Drive, arrived: Arrived, refused: Refused
    ) -> None:
        """``door`` is where its requests go that are not of Modbus."""
        self.drive = drive
        self.period_s = PLANT.owner_period_s
        self.is_silent = False
        self.acknowledges_always = False
        """In each second cycle, and its words enable whatever becomes of the drive."""
        self.pauses = False
        """It lets its drive run for a second and stops it for a third of one, again and again."""
        self._starts: int | None = None
        """How much it has sent to start its drive by a command; None while it does so by words."""
        self.stops_long = False
        """It stops its drive for a second, and lets it run for another, again and again."""
        self.acknowledges = True
        self.in_set = 1
        """Parameter set of a NORD drive that it commands."""
        self.is_invalid = False
        """Its words lack "control data valid"."""
        self._world = world
        self._door = door
        self._arrived = arrived
        self._refused = refused
        self._number = 0
        self._place = 0
        self._cycles = 0
        self._moves = False
        self.line: Line | None = None
        if drive.protocol == "modbus":
            self.line = Line(world, bridge, f"127.0.1.{10 + drive.place}", self._on_bytes)
            self.line.connect()
        else:
            door.on_start.append(self._connected)
        world.after(drive.place * 0.013, self._cycle)

    @property
    def identity(self) -> Identity:
        """Of a client of OPC UA or zenoh."""
        name = f"controller {self.drive.place}"
        return Identity(_SOURCES[self.drive.protocol], name, connection=f"session {self.drive.place}")

    def _connected(self) -> None:
        self._door.connected(self.identity, is_there=True)

    # the program

    def _cycle(self) -> None:
        self._world.after(self.period_s, self._cycle)
        self._cycles += 1
        if self.is_silent:
            return
        if self._starts is not None and not (self._moves and self._starts >= len(_STARTS)):
            self._start(self._starts)
            return
        if self.acknowledges_always and not self._moves:
            self._acknowledge()
        self._write(NORD_INVALID if self.is_invalid else self._word() | self.in_set - 1 << 14)

    def _start(self, place: int) -> None:
        self._starts = place + 1
        step = _STARTS[place % len(_STARTS)]
        if step == "start":
            self._do(Action.START, START)
        elif step == "alive":
            self._do(Action.KEEP_ALIVE, ALIVE)
        else:
            self._write(self.drive.family.ready if step == "ready" else self.drive.family.acknowledge)

    def _do(self, action: Action, word: int) -> None:
        request = Request(self.identity, self.drive.path, command_of(action))
        self._door.ask(request, _DELAY_S, lambda: self._arrived(self.drive, word), self._on_outcome)

    def _word(self) -> int:
        family = self.drive.family
        jogs = (self.pauses and self._cycles % 4 == 0) or (self.stops_long and self._cycles % 6 < 4)
        if self.acknowledges_always:
            return family.run | (family.acknowledge & ~family.ready if self._cycles % 2 == 0 else 0)
        # What it has read of a drive that it is about to stop is older than that.
        if self._moves and not 0 < self._place < _BEGINS.index("run"):
            self._place = 0
            return family.ready if jogs else family.run
        step = _BEGINS[self._place % len(_BEGINS)]
        self._place += 1
        if step == "acknowledge" and not self.acknowledges:
            return family.ready
        return {"ready": family.ready, "run": family.run, "acknowledge": family.acknowledge}[step]

    def _acknowledge(self) -> None:
        """By its register or its method."""
        if self.line is not None:
            self.line.ask(self.drive.unit, writes(_ACKNOWLEDGE, 1))
            return
        request = Request(self.identity, self.drive.path, command_of(Action.RESET_FAULT))
        self._door.ask(request, _DELAY_S, lambda: None, lambda outcome: None)

    def _write(self, word: int) -> None:
        self._number = (self._number + 1) % NUMBERS
        setpoint = self.drive.family.setpoint + self._number
        if self.line is not None:
            sent = self._world.now

            def answered(pdu: bytes) -> None:
                mask, value = self.drive.family.enabling
                if pdu[0] & _EXCEPTION and word & mask == value:
                    self._refused(self.drive, setpoint, sent, pdu[1])

            self.line.ask(self.drive.unit, writes(0, word, setpoint), answered)
            self.line.ask(self.drive.unit, _READ.pack(_READ_INPUT, *_STATUS), self._on_status)
            return
        values = {"control_word": word, "setpoint_1": setpoint}
        request = Request(self.identity, self.drive.path, Write(values))
        self._door.ask(request, _DELAY_S, lambda: self._on_telegram(word), self._on_outcome)

    def _on_bytes(self, data: bytes) -> None:
        """Telegrams among what reaches the bridge's machine."""
        begin = 0
        while len(data) - begin >= _HEAD.size:
            _, _, length, _ = _HEAD.unpack_from(data, begin)
            pdu, begin = data[begin + _HEAD.size : begin + 6 + length], begin + 6 + length
            if pdu[0] == _WRITE_HOLDING and _WRITE.unpack_from(pdu)[1] == 0:
                self._on_telegram(struct.unpack_from(">H", pdu, _WRITE.size)[0])

    def _on_telegram(self, word: int) -> None:
        """One that is not valid is none."""
        if self.drive.family is not NORD or word != NORD_INVALID:
            self._arrived(self.drive, word)

    def _on_status(self, pdu: bytes) -> None:
        self._moves = not pdu[0] & _EXCEPTION and self._enabled(struct.unpack_from(">H", pdu, 2)[0])

    def _on_outcome(self, outcome: Outcome) -> None:
        word = self._door.good_number(f"{self.drive.path}/status/drive_status_word")
        self._moves = word is not None and self._enabled(int(word))

    def _enabled(self, word: int) -> bool:
        mask, value = self.drive.family.enabled
        return word & mask == value

    # what happens to it

    def start_by_command(self, *, stands: bool) -> None:
        """``stands``: it lets its drive stop before."""
        self._starts = 0 if stands else _STARTS.index("start")

    def go_on_by_words(self) -> None:
        self._starts = None

    def write_ahead(self, times: int) -> None:
        """So many telegrams at once, without waiting for an answer; then it hangs."""
        self.is_silent = True
        if self.line is not None:
            telegram = writes(0, self.drive.family.run, self.drive.family.setpoint)
            self.line.ask_often(self.drive.unit, telegram, times)

    def release(self, released: Callable[[float], None]) -> None:
        """``released`` gets the time at which the request came, when it is answered well."""
        came = self._world.now + _DELAY_S
        if self.line is not None:
            self.line.ask(
                self.drive.unit,
                writes(_RELEASE, 0),
                lambda pdu: None if pdu[0] & _EXCEPTION else released(came),
            )
            return
        request = Request(self.identity, self.drive.path, command_of(Action.RELEASE_CONTROL))
        self._door.ask(
            request, _DELAY_S, lambda: None, lambda outcome: released(came) if outcome.ok else None
        )

    def crash(self) -> None:
        """The program ends, and its connection with it."""
        self.is_silent = True
        if self.line is not None:
            self.line.leave()
        else:
            self._door.connected(self.identity, is_there=False)

    def start(self) -> None:
        """The program goes on, or a new one begins."""
        self.is_silent = False
        self._place = 0
        self._moves = False
        if self.line is None:
            self._connected()
        elif self.line.stream is None:
            self.line.is_wanted = True
            self.line.connect()


class Operator:
    """Somebody at another machine who stops drives, and may do no more."""

    def __init__(self, world: World, bridge: Bridge) -> None:
        self._world = world
        self._bridge = bridge

    def start_nodes(self, nodes: list[str]) -> None:
        """Start what somebody has stopped."""
        identity = Identity(Source.OPCUA, "operator", connection="session 99")
        for node in nodes:
            request = Request(identity, node, command_of(Action.START_NODE))
            self._bridge.ask(request, _DELAY_S, lambda: None, lambda outcome: None)

    def stop(self, drive: Drive, how: str, answered: Callable[[float, Outcome], None]) -> None:
        """``answered`` gets the time at which the request came, and the outcome when it is given."""
        identity = Identity(Source.OPCUA, "operator", connection="session 99")
        came: list[float] = []
        self._bridge.ask(
            Request(identity, drive.path, command_of(Action(how))),
            _DELAY_S,
            lambda: came.append(self._world.now),
            lambda outcome: answered(came[0], outcome),
        )


class Stranger:
    """Another machine that writes "run" to a drive with a setpoint of its own."""

    def __init__(self, world: World, bridge: Bridge, drive: Drive, host: str) -> None:
        self._world = world
        self._drive = drive
        self._line = Line(world, bridge, host, lambda data: None)
        self._line.connect()
        self._is_there = True
        self._cycle()

    def _cycle(self) -> None:
        if not self._is_there:
            return
        family = self._drive.family
        for word in (family.ready, family.run):
            self._line.ask(self._drive.unit, writes(0, word, family.setpoint + NUMBERS))
        self._world.after(0.1, self._cycle)

    def leave(self) -> None:
        self._is_there = False
        self._line.leave()
