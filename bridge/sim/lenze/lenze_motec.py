"""Lenze Inverter Drive 8400 motec with its CANopen unit: one node, one drive (EDS84DMOTCAN 3.0)."""

from __future__ import annotations

from typing import Final

from bridge.canopen.frame import REMOTE, STANDARD_MASK, Frame
from bridge.sim.core.canopen_slave import CanopenSlave
from bridge.sim.core.dictionary import Dictionary, IntegerType, Number
from bridge.sim.core.emcy_producer import EmcyProducer
from bridge.sim.core.nmt_slave import CommandSpecifier, SlaveState
from bridge.sim.core.pdo_timing import entries_of
from bridge.sim.core.sdo_server import SimulatedSdoServer
from bridge.sim.core.simulated_device import SimulatedDevice
from bridge.sim.core.store import Store
from bridge.sim.core.supervision import Cycle
from bridge.sim.core.ticks import earliest
from bridge.sim.lenze.lenze_codes import BusDisplay, CodeParts, add_codes
from bridge.sim.lenze.lenze_drive import LenzeDrive, Reaction
from bridge.sim.lenze.lenze_objects import LenzeObjects
from bridge.sim.lenze.lenze_settings import (
    PDOS,
    PORT_IN,
    PORT_OUT,
    PORT_WORDS,
    RULES,
    LenzeCodes,
    communication,
)
from bridge.sim.lenze.lenze_traffic import QuasiMaster, counters_of
from bridge.sim.lenze.lenze_watch import BUS_OFF, LenzeWatch

_HEARTBEAT: Final = 0x700


class LenzeMotec(SimulatedDevice):
    """``words`` are those of PDO1 and PDO2, one to four. ``fail`` and its like happen at the next ``on_time``
    or ``on_frame``."""

    def __init__(
        self, node_id: int, *, words: tuple[int, int] = (4, 4), codes: LenzeCodes | None = None
    ) -> None:
        super().__init__(node_id)
        self._codes = Store(lambda: LenzeCodes(node_id))
        if codes is not None:
            self._codes.current = codes
        self.save()  # commissioned before it was connected to this bus
        self._stack = Store(lambda: communication(self._codes.current, words))
        self.drive = LenzeDrive(lambda: self._codes.current)
        self.display = BusDisplay()
        self._words = [0] * PDOS * PORT_WORDS
        self._own: list[Frame] = []
        emcy = EmcyProducer(self._stack, RULES)
        self._watch = LenzeWatch(lambda: self.codes, self.drive, emcy)
        # 1005h, bit 30, and C00369.
        self._sync = Cycle(lambda: self.codes.sync_ms / 1000 if self.codes.sync_producer else 0.0)
        self._master = QuasiMaster(lambda: self.codes)
        self.objects = Dictionary()
        self._process = self._ports()
        servers = [
            SimulatedSdoServer(self.objects, RULES.sdo_block_segments) for _ in self._stack.current.sdo
        ]
        self.slave = CanopenSlave(node_id, self._stack, self._process, servers, emcy, self)
        self.drive.dirty = self.slave.dirty
        self._fill(emcy)
        self.heard = self._hears()

    @property
    def codes(self) -> LenzeCodes:
        """The codes as they are now."""
        return self._codes.current

    @property
    def dictionary(self) -> Dictionary:
        return self.objects

    def save(self) -> None:
        """Save the codes, which then outlast the mains: by C00002/11, or by whoever commissions the drive."""
        self._codes.save()

    def _sent(self) -> list[Frame]:
        frames = super()._sent()
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

    # The application of the CANopen slave.

    def nmt_changed(self, state: SlaveState) -> None:
        self._watch.nmt_changed(state, self._now)

    def restarted(self, command: CommandSpecifier) -> None:
        # Both resets initialise all that concerns CAN (§7.2.1); codes that were not saved stay until the
        # mains are switched off (§7.1.2). The words from the bus begin anew, so the drive is not enabled.
        del command
        self.node_id = self.slave.node_id = self.codes.node_id
        self._words = [0] * len(self._words)
        self.drive.on_words(self._words)
        self._reset_communication()

    def rpdo_applied(self, number: int) -> None:
        self._watch.on_rpdo(number, self._now)
        self.drive.on_words(self._words)

    def master_lost(self) -> None:
        """Never: there is no node guarding."""

    def master_back(self) -> None:
        """Never."""

    # How it works inside.

    def _switch_on(self) -> None:
        self._codes.power_on()
        self._stack.power_on()
        self.node_id = self.slave.node_id = self.codes.node_id
        self.drive.power_on(self._now)
        self.display.reset()
        self._reset_communication()

    def _pass_time(self) -> None:
        self.drive.advance(self._now)
        if self._watch.expire(self._now) and self.slave.state is SlaveState.OPERATIONAL:
            self._command_self(CommandSpecifier.ENTER_PRE_OPERATIONAL)

    def _deadlines(self) -> tuple[float | None, ...]:
        parts = (self.drive, self._watch, self._sync, self._master)
        return tuple(part.next_deadline() for part in parts)

    def _ports(self) -> Dictionary:
        """CAN1_IN … CAN2_OUT: what the static mapping carries."""
        ports = Dictionary()
        for place in range(len(self._words)):

            def write(value: int, place: int = place) -> None:
                self._words[place] = value

            def read(place: int = place) -> int:
                return (self.drive.status_word, self.drive.speed_word)[place] if place < 2 else 0

            u16 = IntegerType.UNSIGNED16
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
            lambda: self._injected.append(lambda: self._command_self(CommandSpecifier.RESET_NODE)),
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

    def _receive(self, frame: Frame) -> None:
        cob_id = frame.can_id & STANDARD_MASK
        if frame.can_id & REMOTE:
            self._on_remote(cob_id)
        else:
            self._on_data(cob_id, frame)

    def _on_remote(self, cob_id: int) -> None:
        """A TPDO may be asked for (§8.4). A guard request gets no answer."""
        for pdo in self._stack.current.tpdo:
            if self.slave.state is SlaveState.OPERATIONAL and pdo.enabled and pdo.cob_id == cob_id:
                words = b"".join(entry.upload() for entry in entries_of(self._process, pdo))
                self._own.append(Frame(cob_id, words))

    def _on_data(self, cob_id: int, frame: Frame) -> None:
        self.display.count(*counters_of(cob_id, self._stack.current, sent=False))
        if self._watch.node and cob_id == _HEARTBEAT + self._watch.node:
            self._watch.on_heartbeat(frame.data, self._now)
            return
        if self.slave.state is SlaveState.OPERATIONAL:
            for pdo in self._stack.current.rpdo:
                if pdo.enabled and cob_id == pdo.cob_id:
                    self._watch.check_length(len(frame.data), pdo.mapped_bits // 8)
        self.slave.on_frame(frame, self._now)

    def _command_self(self, command: CommandSpecifier) -> None:
        self.slave.on_frame(Frame(0, bytes([command, self.slave.node_id])), self._now)

    def _finish_due(self) -> float | None:
        return earliest(super()._finish_due(), self._master.next_deadline(), self._sync.next_deadline())

    def _finish(self) -> None:
        if self._master.due(self._now):
            start = Frame(0, bytes([CommandSpecifier.START, 0]))
            self._own.append(start)
            self.slave.on_frame(start, self._now)
        if self._sync.due(self._now) and self.slave.state is not SlaveState.STOPPED:
            sync = Frame(self.codes.sync_tx)
            self._own.append(sync)
            self.slave.on_frame(sync, self._now)
        self._watch.report(self._stack.current)
        self.slave.poll(self._now)
