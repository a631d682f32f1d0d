"""A simulated node of any kind: what a mapping or a device description says, and nothing more."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Final

from bridge.canopen.frame import Frame
from bridge.sim.core.canopen_slave import CanopenSlave
from bridge.sim.core.communication_objects import add_communication
from bridge.sim.core.communication_settings import SlaveRules
from bridge.sim.core.dictionary import Dictionary, Domain, Entry, IntegerType, Number, VisibleString, constant
from bridge.sim.core.emcy_producer import EmcyProducer
from bridge.sim.core.nmt_slave import CommandSpecifier, SlaveState
from bridge.sim.core.pdo_objects import PdoConfigurator
from bridge.sim.core.sdo_abort import SdoAbort
from bridge.sim.core.sdo_server import SimulatedSdoServer
from bridge.sim.core.simulated_device import SimulatedDevice
from bridge.sim.core.store import Store
from bridge.sim.core.supervision import HeartbeatWatch
from bridge.sim.generic.generic_axis import GenericAxis
from bridge.sim.generic.generic_inputs import TICK_S, Motion
from bridge.sim.generic.generic_outputs import behaviour_in_error, outputs_in_error
from bridge.sim.generic.generic_plan import At, AxisPlan, BytesPlan, Copy, GenericPdo, NodePlan, NumberPlan

_RULES: Final = SlaveRules()
_HEARTBEAT: Final = 0x700
_MASTER_LOST: Final = 0x8130
_CONSUMER: Final = (0x1016, 1)
_LONGEST: Final = 1 << 16
_PDO_OBJECTS: Final = range(0x1400, 0x1C00)
_IN_ERROR: Final = {0: CommandSpecifier.ENTER_PRE_OPERATIONAL, 2: CommandSpecifier.STOP}
"""NMT commands for the values of 1029h:01, carried out when the node has lost its master."""


class GenericNode(SimulatedDevice):
    """``fail`` happens at the next ``on_time`` or ``on_frame``. ``motions`` are inputs that move by
    themselves."""

    def __init__(self, node_id: int, plan: NodePlan, motions: Sequence[Motion] = ()) -> None:
        super().__init__(node_id)
        self._plan = plan
        self._motions = tuple(motions)
        self._moved_at: float | None = None
        self._communication = Store(lambda: plan.communication(node_id))
        numbers = {one.at: one.value for one in plan.objects if isinstance(one, NumberPlan)}
        contents = {one.at: one.value for one in plan.objects if isinstance(one, BytesPlan)}
        self._numbers = Store(lambda: copy.copy(numbers))
        self._contents = Store(lambda: copy.copy(contents))
        self._emcy = EmcyProducer(self._communication, _RULES)
        self.axes = tuple(GenericAxis(axis, partial(self._report, axis)) for axis in plan.axes)
        self._consumer = HeartbeatWatch(
            lambda: self._watched() >> 16 & 0x7F, lambda: self._watched() & 0xFFFF
        )
        self.objects = Dictionary()
        self._fill()
        server = SimulatedSdoServer(self.objects, _RULES.sdo_block_segments)
        self.slave = CanopenSlave(node_id, self._communication, self.objects, [server], self._emcy, self)
        self.heard = self._hears()

    def value(self, at: At) -> int:
        """The number that an object holds."""
        return self._numbers.current[at]

    def set_value(self, at: At, value: int) -> None:
        """Set a number, such as an input, for a test or a demonstration."""
        self._injected.append(lambda: self._numbers.current.update({at: value}))

    def fail(self, code: int, axis: int = 0) -> None:
        """An error of an axis, with this EMCY code."""
        self._injected.append(lambda: self.axes[axis].fail(code))

    # The application of the CANopen slave.

    def nmt_changed(self, state: SlaveState) -> None:
        if state is SlaveState.STOPPED:
            self._lose_master()

    def restarted(self, command: CommandSpecifier) -> None:
        if command is CommandSpecifier.RESET_NODE:
            self._restart()
            return
        self._consumer.stop()
        self._lose_master()

    def rpdo_applied(self, number: int) -> None:
        del number
        self._settle()

    def master_lost(self) -> None:
        self._lose_master()
        self._emcy.report(_MASTER_LOST, 0x11)
        command = _IN_ERROR.get(behaviour_in_error(self._numbers.current))
        if command is not None and self.slave.state is SlaveState.OPERATIONAL:
            self.slave.on_frame(Frame(0, bytes([command, self.node_id])), self._now)

    def master_back(self) -> None:
        self._emcy.report(0, 0)

    # How it works inside.

    def _switch_on(self) -> None:
        self._communication.power_on()
        self._restart()

    def _restart(self) -> None:
        self._numbers.power_on()
        self._contents.power_on()
        self._emcy.error_register = 0
        self._consumer.stop()
        for axis in self.axes:
            axis.power_on()
        self._settle()

    def _pass_time(self) -> None:
        if self._consumer.expired(self._now):
            self.master_lost()
        if self._motions and (self._moved_at is None or self._now >= self._moved_at + TICK_S):
            self._move()

    def _move(self) -> None:
        tick = int(self._now / TICK_S + 0.5)
        self._moved_at = self._now
        self.slave.dirty.is_set = True
        for motion in self._motions:
            self._numbers.current.update(motion.values(tick))

    def _receive(self, frame: Frame) -> None:
        if self._consumer.node and frame.can_id == _HEARTBEAT + self._consumer.node:
            if self._consumer.on_heartbeat(frame.data, self._now):
                self.master_back()
            return
        self.slave.on_frame(frame, self._now)
        self._settle()

    def _deadlines(self) -> tuple[float | None, ...]:
        moves_at = None if self._moved_at is None else self._moved_at + TICK_S
        return (self._consumer.next_deadline(), moves_at)

    def _hears(self) -> frozenset[int]:
        watched = {_HEARTBEAT + self._consumer.node} if self._consumer.node else set[int]()
        return self.slave.hears() | watched

    def _watched(self) -> int:
        return self._numbers.current.get(_CONSUMER, 0)

    def _lose_master(self) -> None:
        self._numbers.current.update(list(outputs_in_error(self._numbers.current)))
        for axis in self.axes:
            axis.master_lost()
        self._settle()

    def _report(self, axis: AxisPlan, code: int) -> None:
        if axis.error in self._numbers.current:
            self._numbers.current[axis.error] = code
        self._emcy.report(code, 1 if code else 0)

    def _settle(self) -> None:
        """Actual values are what the set-points and the states make of them."""
        for axis in self.axes:
            if axis.obey():
                self.slave.dirty.is_set = True
        numbers = self._numbers.current
        before = [numbers.get(one.target) for one in self._copies()]
        for one in self._plan.mirrors:
            self._copy(one, is_on=True)
        for axis in self.axes:
            for one in axis.plan.copies:
                self._copy(one, is_on=axis.is_enabled)
        if before != [numbers.get(one.target) for one in self._copies()]:
            self.slave.dirty.is_set = True

    def _copies(self) -> list[Copy]:
        return [*self._plan.mirrors, *(one for axis in self._plan.axes for one in axis.copies)]

    def _copy(self, one: Copy, *, is_on: bool) -> None:
        numbers = self._numbers.current
        if one.source in numbers and one.target in numbers and (is_on or not one.stays):
            numbers[one.target] = numbers[one.source] if is_on else 0

    # Its objects.

    def _fill(self) -> None:
        everything = Dictionary()
        stores = (self._communication, self._numbers, self._contents)
        add_communication(everything, self._plan.identity, self._status, self._emcy, *stores)
        pdos = PdoConfigurator(
            self.objects, self._communication, _RULES, lambda: self.slave.state is SlaveState.PRE_OPERATIONAL
        )
        pdos.add()
        taken = self._add_communication(everything)
        for one in self._plan.objects:
            # What a PDO has beyond what PDOs do here is only kept, such as the deadline of an RPDO.
            is_of_pdo = one.at[0] in _PDO_OBJECTS and _has(self.objects, *one.at)
            if not is_of_pdo and one.at not in taken:
                self.objects.add(
                    *one.at, self._number(one) if isinstance(one, NumberPlan) else self._text(one)
                )
        for axis in self.axes:
            self._add_axis(axis)
        self._add_counts()
        for plans, base in ((self._plan.rpdo, 0x1400), (self._plan.tpdo, 0x1800)):
            for plan in plans:
                self._fix(plan, base)

    def _status(self) -> int:
        return self.axes[0].status_word if self.axes else 0

    def _add_communication(self, everything: Dictionary) -> set[At]:
        """Add the communication objects that the node has, and return them all."""
        taken: set[At] = set()
        for index in range(0x1000, 0x1300):
            if not everything.has_object(index):
                continue
            for sub in range(0x100):
                try:
                    entry = everything.find(index, sub)
                except SdoAbort:
                    break
                if self._plan.only is None or (index, sub) in self._plan.only:
                    self.objects.add(index, sub, entry)
                    taken.add((index, sub))
        return taken

    def _number(self, plan: NumberPlan) -> Number:
        at = plan.at

        def write(value: int) -> None:
            self._numbers.current[at] = value

        return Number(
            plan.data_type,
            (lambda: self._numbers.current[at]) if plan.readable else None,
            write if plan.writable else None,
            plan.low,
            plan.high,
            plan.in_rpdo and plan.writable,
            plan.in_tpdo and plan.readable,
        )

    def _text(self, plan: BytesPlan) -> Entry:
        at = plan.at
        if not plan.writable:
            return VisibleString(plan.value.decode("ascii", "replace").replace("\ufffd", "?"))

        def write(data: bytes) -> None:
            self._contents.current[at] = data

        return Domain(_LONGEST, lambda: self._contents.current[at], write)

    def _add_axis(self, axis: GenericAxis) -> None:
        for place, at in enumerate(axis.plan.control):
            kind, shift, mask = _part(len(axis.plan.control), place)

            def write(value: int, shift: int = shift, mask: int = mask) -> None:
                axis.write(value, shift, mask)

            def read(shift: int = shift, mask: int = mask) -> int:
                return axis.control_word >> shift & mask

            self.objects.add(*at, Number(kind, read, write, in_rpdo=True, in_tpdo=True))
        for place, at in enumerate(axis.plan.status):
            kind, shift, mask = _part(len(axis.plan.status), place)

            def status(shift: int = shift, mask: int = mask) -> int:
                return axis.status_word >> shift & mask

            self.objects.add(*at, Number(kind, status, in_tpdo=True))

    def _add_counts(self) -> None:
        """Sub-index 0 of every array and record that has none of its own."""
        most: dict[int, int] = {}
        ats = [one.at for one in self._plan.objects]
        ats += [at for axis in self._plan.axes for at in (*axis.control, *axis.status)]
        for index, sub in ats:
            most[index] = max(sub, most.get(index, 0))
        for index, sub in most.items():
            if sub and index not in _PDO_OBJECTS and not _has(self.objects, index, 0):
                self.objects.add(index, 0, constant(IntegerType.UNSIGNED8, sub))

    def _fix(self, plan: GenericPdo, base: int) -> None:
        """Take the right to write from what the node has fixed."""
        index = base + plan.number - 1
        if plan.fixed_cob_id:
            self._seal(index, 1)
        if plan.fixed_mapping:
            for sub in range(plan.entries + 1):
                self._seal(index + 0x200, sub)

    def _seal(self, index: int, sub: int) -> None:
        if _has(self.objects, index, sub):
            entry = self.objects.find(index, sub)
            if isinstance(entry, Number):
                self.objects.add(index, sub, replace(entry, write=None))


def _part(parts: int, place: int) -> tuple[IntegerType, int, int]:
    """Type, lowest bit and mask of a part of a word."""
    if parts == 1:
        return IntegerType.UNSIGNED16, 0, 0xFFFF
    return IntegerType.UNSIGNED8, 8 * place, 0xFF


def _has(objects: Dictionary, index: int, sub: int) -> bool:
    try:
        objects.find(index, sub)
    except SdoAbort:
        return False
    return True
