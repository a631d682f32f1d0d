"""Lenze Inverter Drive 8400 motec with its CANopen unit: one node, one drive (EDS84DMOTCAN 3.0)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from bridge.canopen.frame import ERROR, EXTENDED, REMOTE, STANDARD_MASK, Frame
from bridge.sim.canopen_slave import CanopenSlave
from bridge.sim.dictionary import DataType, Dictionary, Number
from bridge.sim.emcy_producer import EmcyProducer
from bridge.sim.lenze_codes import BusDisplay, CodeParts, add_codes
from bridge.sim.lenze_drive import LenzeDrive, Reaction
from bridge.sim.lenze_objects import LenzeObjects
from bridge.sim.lenze_settings import PDOS, PORT_IN, PORT_OUT, PORT_WORDS, RULES, LenzeCodes, communication
from bridge.sim.lenze_traffic import QuasiMaster, SyncProducer, counters_of
from bridge.sim.lenze_watch import BUS_OFF, BusWatch
from bridge.sim.nmt_slave import NmtCommand, NmtState
from bridge.sim.pdo import pack
from bridge.sim.sdo_server import SdoServer
from bridge.sim.store import Store

_HEARTBEAT: Final = 0x700


class LenzeMotec:
    """The node as the CAN bus sees it. Times are seconds of the caller's monotonic clock.

    ``words`` are those of PDO1 and PDO2, one to four. What is injected (``fail`` and its like) happens at
    the next ``on_time`` or ``on_frame``; ``next_deadline`` says at once that there is something to do.
    """

    def __init__(
        self, node_id: int, *, words: tuple[int, int] = (4, 4), codes: LenzeCodes | None = None
    ) -> None:
        self._codes = Store(lambda: LenzeCodes(node_id))
        if codes is not None:
            self._codes.current = codes
        self.save()  # commissioned before it came onto this bus
        self._stack = Store(lambda: communication(self._codes.current, words))
        self.drive = LenzeDrive(lambda: self._codes.current)
        self.display = BusDisplay()
        self.powered = False
        self._words = [0] * PDOS * PORT_WORDS
        self._now = 0.0
        self._injected: list[Callable[[], None]] = []
        self._own: list[Frame] = []
        emcy = EmcyProducer(self._stack, RULES)
        self._watch = BusWatch(lambda: self.codes, self.drive, emcy)
        self._sync = SyncProducer(lambda: self.codes)
        self._master = QuasiMaster(lambda: self.codes)
        self.objects = Dictionary()
        self._process = self._ports()
        servers = [SdoServer(self.objects, RULES.sdo_block_segments) for _ in self._stack.current.sdo]
        self.slave = CanopenSlave(node_id, self._stack, self._process, servers, emcy, self)
        self._fill(emcy)
        self.heard = self._hears()

    @property
    def node_id(self) -> int:
        return self.slave.node_id

    @property
    def codes(self) -> LenzeCodes:
        """The codes as they are now."""
        return self._codes.current

    def save(self) -> None:
        """What C00002/11 does, and who commissions it: the codes outlast the mains."""
        self._codes.save()

    # The core: frames and time in, frames out.

    def start(self, now: float) -> None:
        """Power on."""
        self._now = now
        self._codes.power_on()
        self._stack.power_on()
        self.slave.node_id = self.codes.node_id
        self.drive.power_on(now)
        self.display.reset()
        self._reset_communication()
        self.powered = True
        self.slave.boot()
        self.heard = self._hears()

    def on_frame(self, frame: Frame, now: float) -> None:
        cob_id = frame.can_id & STANDARD_MASK
        if not self.powered or cob_id not in self.heard or frame.can_id & (EXTENDED | ERROR):
            return
        self._advance(now)
        if frame.can_id & REMOTE:
            self._on_remote(cob_id)
        else:
            self._on_data(cob_id, frame)
        if self.powered:
            self._finish()
        self.heard = self._hears()

    def on_time(self, now: float) -> None:
        self._advance(now)
        if self.powered:
            self._finish()

    def next_deadline(self) -> float | None:
        if self._injected:
            return self._now
        if not self.powered:
            return None
        deadlines = [self.slave.next_deadline(), self.drive.next_deadline(), self._watch.next_deadline()]
        deadlines += [self._sync.next_deadline(), self._master.next_deadline()]
        return min((deadline for deadline in deadlines if deadline is not None), default=None)

    def take_frames(self) -> list[Frame]:
        frames = self.slave.take_frames()
        if not self.slave.silent:
            frames += self._own
        self._own = []
        for frame in frames:
            self.display.count(*counters_of(frame.can_id, self._stack.current, sent=True))
        return frames

    # What a test or a demonstration does to the node.

    def fail(self, number: int, reaction: Reaction = Reaction.FAULT, *, lasting: bool = False) -> None:
        """An error of the drive, such as a fault with the number that C00168 shows."""
        self._injected.append(lambda: self.drive.error(number, reaction, lasting=lasting))

    def mend(self, number: int) -> None:
        """The cause of that error is gone."""
        self._injected.append(lambda: self.drive.cause_gone(number))

    def bus_error(self, state: int, tx_errors: int = 0, rx_errors: int = 0) -> None:
        """C00345: 0 none, 1 warning, 2 error passive, 3 bus-off, in which nothing is sent or received."""

        def happen() -> None:
            display = self.display
            display.error_state, display.tx_errors, display.rx_errors = state, tx_errors, rx_errors
            self.slave.silent = state == BUS_OFF
            self._watch.bus_error(state)

        self._injected.append(happen)

    def supply(self, *, there: bool) -> None:
        """The supply from the drive unit: EMCY 3100h while it is not there (§10.4)."""
        self._injected.append(lambda: self._watch.supply(there=there))

    def silence(self) -> None:
        """The node sends nothing more; it goes on receiving and working."""
        self.slave.silent = True

    def speak(self) -> None:
        self.slave.silent = False

    def power_off(self) -> None:
        """Mains off."""

        def off() -> None:
            self.powered = False
            self.slave.power_off()

        self._injected.append(off)

    def power_cycle(self) -> None:
        """Off and on again: what was not saved is lost, the boot-up message comes."""
        self.power_off()
        self._injected.append(lambda: self.start(self._now))

    # The application of the CANopen slave.

    def nmt_changed(self, state: NmtState) -> None:
        self._watch.nmt_changed(state, self._now)

    def restarted(self, command: NmtCommand) -> None:
        # Both resets initialise all that concerns CAN (§7.2.1); codes that were not saved stay until the
        # mains are switched off (§7.1.2). The words from the bus begin anew, so the drive is not enabled.
        del command
        self.slave.node_id = self.codes.node_id
        self._words = [0] * len(self._words)
        self.drive.on_words(self._words)
        self._reset_communication()

    def accepts_rpdo(self, number: int, length: int) -> bool:
        del number, length  # too short ones do not come here; of a longer one the first bytes count
        return True

    def rpdo_applied(self, number: int) -> None:
        self._watch.on_rpdo(number, self._now)
        self.drive.on_words(self._words)

    def master_lost(self) -> None:
        """Never: there is no node guarding."""

    def master_back(self) -> None:
        """Never."""

    # How it works inside.

    def _ports(self) -> Dictionary:
        """CAN1_IN … CAN2_OUT: what the static mapping carries."""
        ports = Dictionary()
        for place in range(len(self._words)):

            def write(value: int, place: int = place) -> None:
                self._words[place] = value

            def read(place: int = place) -> int:
                return (self.drive.status_word, self.drive.speed_word)[place] if place < 2 else 0

            u16 = DataType.UNSIGNED16
            ports.add(PORT_IN, place + 1, Number(u16, None, write, in_rpdo=True))
            ports.add(PORT_OUT, place + 1, Number(u16, read, in_tpdo=True))
        return ports

    def _fill(self, emcy: EmcyProducer) -> None:
        objects = LenzeObjects(self._codes, self._stack)
        objects.add_to(self.objects, emcy)
        parts = CodeParts(
            self._codes,
            self._stack,
            objects,
            self.drive,
            self.display,
            lambda: self.slave.state,
            lambda: self._watch.node_status,
            self.save,
            lambda: self._injected.append(lambda: self._command_self(NmtCommand.RESET_NODE)),
        )
        add_codes(self.objects, parts)

    def _hears(self) -> frozenset[int]:
        more = {pdo.cob_id for pdo in self._stack.current.tpdo}
        if self._watch.node:
            more.add(_HEARTBEAT + self._watch.node)
        return self.slave.hears() | more

    def _reset_communication(self) -> None:
        self._watch.reset()
        self._sync.reset()
        self._master.start(self._now)

    def _on_remote(self, cob_id: int) -> None:
        """A TPDO may be asked for (§8.4). A guard request gets no answer."""
        for pdo in self._stack.current.tpdo:
            if self.slave.state is NmtState.OPERATIONAL and pdo.enabled and pdo.cob_id == cob_id:
                self._own.append(Frame(cob_id, pack(self._process, pdo)))

    def _on_data(self, cob_id: int, frame: Frame) -> None:
        self.display.count(*counters_of(cob_id, self._stack.current, sent=False))
        if self._watch.node and cob_id == _HEARTBEAT + self._watch.node:
            self._watch.on_heartbeat(frame.data, self._now)
            return
        if self.slave.state is NmtState.OPERATIONAL:
            for pdo in self._stack.current.rpdo:
                if pdo.enabled and cob_id == pdo.cob_id:
                    self._watch.check_length(len(frame.data), pdo.mapped_bits // 8)
        self.slave.on_frame(frame, self._now)

    def _advance(self, now: float) -> None:
        self._now = max(self._now, now)  # stamps of frames may lie before the last timer
        if self.powered:
            self.drive.advance(self._now)
            if self._watch.expire(self._now) and self.slave.state is NmtState.OPERATIONAL:
                self._command_self(NmtCommand.ENTER_PRE_OPERATIONAL)
        injected, self._injected = self._injected, []
        for action in injected:
            action()

    def _command_self(self, command: NmtCommand) -> None:
        self.slave.on_frame(Frame(0, bytes([command, self.slave.node_id])), self._now)

    def _finish(self) -> None:
        if self._master.due(self._now):
            start = Frame(0, bytes([NmtCommand.START, 0]))
            self._own.append(start)
            self.slave.on_frame(start, self._now)
        if self._sync.due(self._now) and self.slave.state is not NmtState.STOPPED:
            sync = Frame(self.codes.sync_tx)
            self._own.append(sync)
            self.slave.on_frame(sync, self._now)
        self._watch.report(self._stack.current)
        self.slave.poll(self._now)
