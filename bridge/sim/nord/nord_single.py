"""A node with one NORD inverter SK 5xxE: with an SK TU3-CAO, or through its own RJ45 sockets (BU 2500)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from bridge.sim.core.communication_objects import add_communication
from bridge.sim.core.dictionary import Dictionary, IntegerType, Number, constant
from bridge.sim.core.nmt_slave import CommandSpecifier, SlaveState
from bridge.sim.core.pdo_objects import PdoConfigurator
from bridge.sim.core.sdo_server import SimulatedSdoServer
from bridge.sim.core.store import Store
from bridge.sim.nord.nord_drive import VALID, NordDrive
from bridge.sim.nord.nord_faults import LINK_BROKEN, TELEGRAM_DOWNTIME
from bridge.sim.nord.nord_interface import DriveAccess, FirstChannel, identity
from bridge.sim.nord.nord_node import NordNode
from bridge.sim.nord.nord_settings import ACTUAL_VALUES, CONTROL_WORDS, RULES, SETPOINTS, STATUS_WORDS
from bridge.sim.nord.nord_single_settings import ENCODER, TU3, Variant, factory_settings
from bridge.sim.nord.nord_states import NordState
from bridge.sim.nord.nord_supervision import TelegramWatch

_P513: Final = 513
_P745: Final = 0x2000 + 745
_P746: Final = 0x2000 + 746
_VERSION_TENTHS: Final = 10
_INTERFACE_ID: Final = 0x0C00
"""The high byte of P746 (§7.2)."""


class NordSingle(NordNode):
    """``p513_s`` is the only supervision of the master (§8.1): 0 off, -0.1 ignore."""

    def __init__(
        self,
        node_id: int,
        variant: Variant = TU3,
        *,
        p513_s: float = 0.0,
        p105_hz: float = 50.0,
        p112_a: float = 10.0,
        ripple: float = 0.0,
        seed: int = 0,
    ) -> None:
        self.variant = variant
        self.drive = NordDrive(
            p105_hz=p105_hz, p112_a=p112_a, ripple=ripple, seed=seed, parameters=variant.parameters
        )
        self.drive.parameters.commission(_P513, p513_s)
        self.linked = True
        self._control = 0
        self._setpoints = [0] * variant.values
        self._written: set[int] = set()
        """Words written since they were last forwarded: 0 is the control word, n setpoint n."""
        super().__init__(
            node_id,
            [self.drive],
            Store(lambda: factory_settings(node_id, variant)),
            TelegramWatch(self._p513_s),
        )
        self._build()

    # What a test or a demonstration does to the drive.

    def fail_drive(self, fault_tenths: int) -> None:
        """The drive trips by itself; 30 is E003/3.0. The cause does not last: an acknowledge works."""
        self._injected.append(lambda: self.drive.trip(fault_tenths))

    def drop_drive(self) -> None:
        """Cut the connection between interface and drive: 10.8 in the drive (§8.4). With RJ45 there is no
        interface."""
        if not self.variant.has_interface:
            raise ValueError(f"{self.variant.device_name} has no interface that it could lose")
        self._injected.append(self._unlink)

    def restore_drive(self) -> None:
        """Restore that connection. The fault stays until the acknowledge."""
        self._injected.append(self._link)

    # The application of the CANopen slave.

    def restarted(self, command: CommandSpecifier) -> None:
        if command is CommandSpecifier.RESET_COMMUNICATION:
            return  # the application, and with it P513, is not touched (CiA 301 §7.3.2.2.1)
        self._power_on()
        # Interface or CANopen are gone for a moment. The manual does not say how a drive reacts; here
        # a running one reports it, one at rest ignores it.
        if self.drive.state in (NordState.ENABLED, NordState.QUICK_STOP):
            self.drive.communication_lost(LINK_BROKEN if self.variant.has_interface else TELEGRAM_DOWNTIME)
            self.drive.cause_gone()

    def rpdo_applied(self, number: int) -> None:
        del number  # the objects written tell which
        self.slave.dirty.is_set = True
        if 0 in self._written and self._control & VALID and self.linked:
            self._watch.on_telegram(self._now)
            self._causes_gone(TELEGRAM_DOWNTIME)
        self._forward()

    def master_lost(self) -> None:
        if self.linked:
            self.drive.communication_lost(TELEGRAM_DOWNTIME)

    def master_back(self) -> None:
        self._causes_gone(TELEGRAM_DOWNTIME)

    # How it works inside.

    def _fill(self, dictionary: Dictionary, pdos: PdoConfigurator) -> Sequence[SimulatedSdoServer]:
        who = identity(self.variant.device_name)
        add_communication(dictionary, who, self._module_state, self._emcy, self._communication)
        self._add_words(dictionary)
        pdos.add()
        parameters = Dictionary()
        self.drive.add_to(parameters)
        if self.variant.has_interface:
            parameters.add(_P745, 0, constant(IntegerType.INTEGER16, _VERSION_TENTHS))
            parameters.add(_P746, 0, Number(IntegerType.UNSIGNED16, self._module_state))
        access = DriveAccess(parameters, lambda: self.linked)
        return [SimulatedSdoServer(FirstChannel([dictionary, access]), RULES.sdo_block_segments)]

    def _add_words(self, dictionary: Dictionary) -> None:
        """3000h…3003h as §6.5.7 numbers them for one drive: the two words without a sub-index."""
        u16, drive = IntegerType.UNSIGNED16, self.drive

        def set_control(value: int) -> None:
            self._control = value
            self._written.add(0)

        def setpoint(place: int) -> Number:
            def write(value: int) -> None:
                self._setpoints[place] = value
                self._written.add(place + 1)

            return Number(u16, lambda: self._setpoints[place], write, in_rpdo=True, in_tpdo=True)

        def actual(place: int) -> Number:
            return Number(u16, lambda: drive.actual_value(place + 1) if self.linked else 0, in_tpdo=True)

        control = Number(u16, lambda: self._control, set_control, in_rpdo=True, in_tpdo=True)
        status = Number(u16, lambda: drive.status_word if self.linked else 0, in_tpdo=True)
        dictionary.add(CONTROL_WORDS, 0, control)
        dictionary.add(STATUS_WORDS, 0, status)
        dictionary.add_array(SETPOINTS, [setpoint(place) for place in range(self.variant.values)])
        dictionary.add_array(ACTUAL_VALUES, [actual(place) for place in range(self.variant.values)])
        if not self.variant.has_interface:
            dictionary.add(ENCODER, 0, self._encoder())
            self.drive.has_encoder = True

    def _encoder(self) -> Number:
        """The position from an absolute encoder, or from a test that plays one."""

        def write(value: int) -> None:
            self.drive.position_increments = value

        return Number(
            IntegerType.INTEGER32,
            lambda: round(self.drive.position_increments),
            write,
            in_rpdo=True,
            in_tpdo=True,
        )

    def _p513_s(self) -> float:
        """P513; at -0.1 s the drive ignores it."""
        return max(0.0, self.drive.parameters.value(_P513))

    def _module_state(self) -> int:
        """P746 (§7.2): ready, operational, fault, time-out; 0Ch in the high byte. 1002h shows it too."""
        state = 0x01 | (0x02 if self.slave.state is SlaveState.OPERATIONAL else 0)
        state |= (0 if self.linked else 0x10) | (0x20 if self._watch.tripped else 0)
        return state | _INTERFACE_ID if self.variant.has_interface else state

    def _power_on(self) -> None:
        self._control, self._setpoints = 0, [0] * self.variant.values
        self._written.clear()
        self._watch.stop()
        self._reporter.reset()

    def _words_by_sdo(self) -> None:
        if self.slave.state is SlaveState.OPERATIONAL:
            # They act on the drive, but only a process data telegram restarts P513.
            self._forward()

    def _watch_expired(self) -> None:
        if self.linked:
            self.drive.communication_lost(TELEGRAM_DOWNTIME)

    def _unlink(self) -> None:
        self.linked = False
        self.drive.communication_lost(LINK_BROKEN)

    def _link(self) -> None:
        self.linked = True
        self._causes_gone(LINK_BROKEN)

    def _forward(self) -> None:
        written, self._written = self._written, set()
        if not written or not self.linked:
            return
        setpoints = list(self._setpoints)
        if self.variant.has_interface and 0 in written:
            # §6.5.7: which RPDO is sent decides whether one or up to three setpoints are evaluated.
            setpoints = [word if n in written else 0 for n, word in enumerate(setpoints, start=1)]
        self.drive.on_telegram(self._control, setpoints)

    def _present_faults(self) -> Sequence[int | None]:
        return [self.drive.fault_tenths if self.linked else None]
