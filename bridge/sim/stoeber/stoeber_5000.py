"""STÖBER MDS/FDS/SDS 5000 with CAN 5000: one axis, or four behind a POSISwitch (ID 441684.06)."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from bridge.canopen.frame import Frame
from bridge.sim.core.emcy_producer import EmcyProducer
from bridge.sim.core.nmt_slave import CommandSpecifier, SlaveState
from bridge.sim.core.sdo_server import SimulatedSdoServer
from bridge.sim.core.simulated_device import SimulatedDevice
from bridge.sim.core.store import Store
from bridge.sim.core.supervision import SignWatch
from bridge.sim.stoeber.stoeber_axis import StoeberAxis
from bridge.sim.stoeber.stoeber_device import StoeberDevice
from bridge.sim.stoeber.stoeber_dictionary import AxisView, WideDictionary
from bridge.sim.stoeber.stoeber_events import CODES, COMMUNICATION, LIFE_GUARDING, SYNC_MISSING
from bridge.sim.stoeber.stoeber_objects import CommunicationObjects, identity
from bridge.sim.stoeber.stoeber_parameters import add_axis, add_device
from bridge.sim.stoeber.stoeber_pdo_objects import StoeberPdoObjects
from bridge.sim.stoeber.stoeber_posi import PositioningAxis
from bridge.sim.stoeber.stoeber_settings import CHANNELS, RULES, factory_communication, factory_settings
from bridge.sim.stoeber.stoeber_slave import StoeberSlave


class Stoeber5000(SimulatedDevice):
    """``axes`` is 1, with A180 and D230 in PDO channel 1, or up to 4, with Q00 and Q01 of axis n in channel
    n. ``positions``: the application of its one axis is command positioning. ``mapped`` says that an
    application was downloaded; a drive as delivered maps nothing. ``fail`` and its like happen at the next
    ``on_time`` or ``on_frame``.
    """

    def __init__(
        self,
        node_id: int,
        *,
        axes: int = 1,
        positions: bool = False,
        mapped: bool = True,
        rated_power_kw: float = 1.5,
        name: str = "MDS 5015",
        bit_31_opens_sdo: bool = False,
    ) -> None:
        if not 1 <= axes <= CHANNELS:
            raise ValueError(f"axes = {axes}: a POSISwitch has 1 … {CHANNELS}")
        if positions and axes > 1:
            raise ValueError("the simulated command positioning has one axis")
        super().__init__(node_id)
        self._communication = Store(
            lambda: factory_communication(node_id, axes, mapped=mapped, positions=positions)
        )
        self._settings = Store(lambda: factory_settings(axes))
        self._emcy = EmcyProducer(self._communication, RULES)
        kind = PositioningAxis if positions else StoeberAxis
        self.device = StoeberDevice(axes, self._settings, self._report, kind)
        self.slave = self._build(rated_power_kw, name, bit_31_opens_sdo)
        self.heard = self.slave.hears()

    @property
    def axes(self) -> tuple[StoeberAxis, ...]:
        return self.device.axes

    # What a test or a demonstration does to the node.

    def commission(self, axis: int | None = None, **values: float) -> None:
        """Set parameters of an axis (from 0), or of all, by the names of ``AxisParameters``, and save
        them, as POSITool does."""
        for number, one in enumerate(self._settings.current.axes):
            if axis in (None, number):
                self._settings.current.axes[number] = replace(one, **values)
        self._settings.save()

    def fail(self, event: int, cause: int = 0, *, lasting: bool = False) -> None:
        """An event of §9.3. A ``lasting`` cause blocks the acknowledge until ``cause_gone``."""
        if event not in CODES:
            raise ValueError(f"no event {event}: 31 … 70 of the list of events")
        self._injected.append(lambda: self.device.trip(event, cause, lasting=lasting))

    def cause_gone(self) -> None:
        self.device.cause_lasts = False

    # The application of the CANopen slave.

    def nmt_changed(self, state: SlaveState) -> None:
        # By the manual only life guarding stops the drive: outside Operational it goes on.
        del state

    def restarted(self, command: CommandSpecifier) -> None:
        if command is CommandSpecifier.RESET_NODE:
            self._restart()

    def master_lost(self) -> None:
        self.device.trip(COMMUNICATION, LIFE_GUARDING)

    def master_back(self) -> None:
        """The event stays until it is acknowledged."""

    # How it works inside.

    def _switch_on(self) -> None:
        self._communication.power_on()
        self._restart()

    def _pass_time(self) -> None:
        self.device.advance(self._now)

    def _receive(self, frame: Frame) -> None:
        self.slave.on_frame(frame, self._now)
        self.device.settle()

    def _deadlines(self) -> tuple[float | None, ...]:
        return (self.device.next_deadline(),)

    def _build(self, rated_power_kw: float, name: str, bit_31_opens_sdo: bool) -> StoeberSlave:
        dictionary = WideDictionary()
        own = [WideDictionary() for _ in self.axes]
        # PDO channel n maps the parameters of axis n, SDO channel n reaches those that A11.n names.
        mapped = [AxisView(dictionary, own, partial(min, n, len(own) - 1)) for n in range(CHANNELS)]
        reached = [AxisView(dictionary, own, partial(self._edited_axis, n + 1)) for n in range(CHANNELS)]
        pdos = StoeberPdoObjects(
            self.node_id,
            mapped[0],
            self._communication,
            lambda: self.slave.state is SlaveState.PRE_OPERATIONAL,
        )
        objects = CommunicationObjects(
            self.node_id, self._communication, self._settings, pdos, bit_31_opens=bit_31_opens_sdo
        )
        objects.add_to(
            dictionary,
            identity(rated_power_kw, name),
            lambda: self.device.error_register,
            lambda: self.device.state,
        )
        add_device(dictionary, self.device, self._settings)
        for number, one in enumerate(own):
            add_axis(one, self.device, number)
        return StoeberSlave(
            self.node_id,
            self._communication,
            mapped,
            [SimulatedSdoServer(view, RULES.sdo_block_segments) for view in reached],
            self._emcy,
            self,
            SignWatch(lambda: self._settings.current.sync_timeout_us / 1e6),
            partial(self.device.trip, COMMUNICATION, SYNC_MISSING),
        )

    def _edited_axis(self, channel: int) -> int:
        return self._settings.current.edited_axis[channel]

    def _report(self, code: int, register: int) -> None:
        self._emcy.report(code, register, bytes([self.device.event, self.device.cause]))

    def _restart(self) -> None:
        self._settings.power_on()
        self._emcy.error_register = 0
        self.device.power_on(self._now)
