"""What simulated drives really do, in the units of their values, and the settings by which their words say
it.

Read from the simulation's motors and parameters and by the manuals' formulas: the bridge's mapping files and
scales have no part in it.
"""

from __future__ import annotations

from math import nan
from typing import Final, NamedTuple, Protocol

from bridge.sim.cia402.cia402_drive import Cia402Drive
from bridge.sim.cia402.cia402_settings import INCREMENTS, Cia402Mode
from bridge.sim.cia402.cia402_states import Cia402State
from bridge.sim.core.simulated_device import SimulatedDevice
from bridge.sim.lenze.lenze_drive import DeviceState
from bridge.sim.lenze.lenze_motec import LenzeMotec
from bridge.sim.nord.nord_drive import NordDrive
from bridge.sim.nord.nord_scales import Aim, Scales
from bridge.sim.nord.nord_single import NordSingle
from bridge.sim.nord.nord_states import NordState
from bridge.sim.nord.nord_tu4 import NordTu4
from bridge.sim.stoeber.stoeber_5000 import Stoeber5000
from bridge.sim.stoeber.stoeber_axis import AxisState
from tests.proof.drives import Drive

_WORDS: Final = (1, 2, 3)
SETS: Final = (1, 2)
"""Parameter sets in which drives are run."""
_HUNDRED_PERCENT: Final = 0x4000
_NETWORK: Final = 40
"""C00007 (EDS84DMOTCAN §8.2)."""
_FREQUENCY, _CURRENT = 1, 3
"""Codes of P543 and P546 (BU 2500 §6.5.4)."""
_LOW, _HIGH = 10, 15
_PER_REVOLUTION: Final = 1000
_STEP: Final = 0.001


class Leaf(NamedTuple):
    """A point of a drive. ``margin`` is in its unit, beside one in a hundred; of a set value, what the
    numbers of telegrams differ by. ``by`` are the settings that decide what it says; ``at_once``: the
    telegram that brings it says by itself what it means."""

    name: str
    margin: float
    by: tuple[str, ...] = ()
    at_once: bool = False
    is_bit: bool = False
    """It says something only where it is true."""
    given: str = ""
    """The setting that the site file gives for it, because the drive does not tell it in this unit."""

    @property
    def is_command(self) -> bool:
        return self.name.startswith("command/")


class Physics(Protocol):
    """``values`` are those of the leaves: None where nothing carries such a value, and ``nan`` where it may
    be anything."""

    leaves: tuple[Leaf, ...]

    def settings(self) -> dict[str, float]: ...

    def values(self) -> tuple[float | None, ...]: ...

    def key(self, name: str) -> str:
        """A setting of those that count now."""
        return name


class NordPhysics(Physics):
    """BU 2500 §6.5.4: words are shares of P105 and P112, and carry what P543 and P546 say, in the parameter
    set of bits 14 and 15. P112 is a current here, and is given in the site file."""

    _ACTUALS: Final = tuple(f"P543[{word}]" for word in _WORDS)
    _SETPOINTS: Final = tuple(f"P546[{word}]" for word in _WORDS)

    def __init__(self, drive: NordDrive) -> None:
        self.drive = drive
        self.leaves = (
            Leaf("actual/frequency", 0.05, ("P105", *self._ACTUALS)),
            Leaf("actual/current", 0.05, ("P112", *self._ACTUALS), given="P112"),
            Leaf("command/frequency", 0.3, ("P105", *self._SETPOINTS)),
        )

    @property
    def _set(self) -> int:
        return (self.drive.control_word >> 14) + 1

    def key(self, name: str) -> str:
        return f"{name} of parameter set {self._set}"

    def settings(self) -> dict[str, float]:
        parameters = self.drive.parameters
        found: dict[str, float] = {}
        for in_set in SETS:
            of_set = f"of parameter set {in_set}"
            found[f"P105 {of_set}"] = parameters.value(105, in_set)
            found[f"P112 {of_set}"] = parameters.value(112, in_set)
            for word in _WORDS:
                found[f"P543[{word}] {of_set}"] = parameters.raw(543, word, in_set)
                found[f"P546[{word}] {of_set}"] = parameters.raw(546, word, in_set)
        return found

    def values(self) -> tuple[float | None, ...]:
        drive, parameters = self.drive, self.drive.parameters
        actuals = [parameters.raw(543, word, self._set) for word in _WORDS]
        return (
            drive.output_hz if _FREQUENCY in actuals else None,
            drive.current_a if _CURRENT in actuals else None,
            self._set_hz(),
        )

    def _set_hz(self) -> float | None:
        drive, parameters = self.drive, self.drive.parameters
        words = [
            word
            for place, word in enumerate(drive.setpoints[: len(_WORDS)], start=1)
            if parameters.raw(546, place, self._set) == _FREQUENCY
        ]
        if len(words) != 1:
            return None  # the drive adds them, and none of them says what it does
        runs = drive.state is NordState.ENABLED and drive.control_word & 0x7F == 0x7F
        return words[0] / _HUNDRED_PERCENT * parameters.value(105, self._set) if runs and words[0] else nan


class PosiconPhysics(Physics):
    """A NORD drive that positions: an SK TU3-CAO with the settings of BU 2500 §5.4."""

    _GEAR: Final = tuple(f"P{number}[{part}]" for number in (607, 608) for part in (1, 2, 3))
    _CODES: Final = {f"P{number}": number for number in (543, 544, 545, 546, 547, 548)}

    def __init__(self, drive: NordDrive) -> None:
        self.drive = drive
        goes = ("P546", "P547", "P548", "P600", *self._GEAR)
        self.leaves = (
            Leaf("actual/position", 0.05, ("P543", "P544", "P545", *self._GEAR, "P604")),
            Leaf("command/position", 0.002, (*goes, "P604")),
            Leaf("actual/target_reached", 0.5, (*goes, "P604"), is_bit=True),
        )

    def settings(self) -> dict[str, float]:
        parameters = self.drive.parameters
        found: dict[str, float] = {name: parameters.raw(number) for name, number in self._CODES.items()}
        for number in (607, 608):
            for part in _WORDS:
                found[f"P{number}[{part}]"] = parameters.raw(number, part)
        return {**found, "P600": parameters.raw(600), "P604": parameters.raw(604)}

    def values(self) -> tuple[float | None, ...]:
        drive = self.drive
        scales = Scales.of(drive.parameters, 1)
        goal = Aim.of(scales, drive.control_word, drive.setpoints, None).increments
        shows = {_LOW, _HIGH} <= set(scales.actual_values)
        goes = drive.state is NordState.ENABLED and drive.control_word & 0x7F == 0x7F
        is_there = goal is not None and abs(goal - drive.position_increments) < 1 and not drive.output_hz
        return (
            drive.position_increments / _PER_REVOLUTION if shows else None,
            None if goal is None else goal / _PER_REVOLUTION if goes else nan,
            float(is_there),
        )


class LenzePhysics(Physics):
    """EDS84DMOTCAN §8.2: words are shares of C00011, and those of the network with C00007 = 40 alone."""

    def __init__(self, device: LenzeMotec) -> None:
        self._device = device
        by = ("C00011", "C00007")
        self.leaves = (Leaf("actual/velocity", 2.0, by), Leaf("command/velocity", 20.0, by))

    def settings(self) -> dict[str, float]:
        codes = self._device.codes
        return {"C00011": codes.reference_rpm, "C00007": codes.control_mode}

    def values(self) -> tuple[float | None, ...]:
        drive, codes = self._device.drive, self._device.codes
        if codes.control_mode != _NETWORK:
            return None, None
        runs = drive.state is DeviceState.OPERATION_ENABLED and drive.setpoint
        set_rpm = drive.setpoint / _HUNDRED_PERCENT * codes.reference_rpm if runs else nan
        return drive.speed_rpm, set_rpm


class StoeberPhysics(Physics):
    """The application's setpoint in 0.1 % of C01; speed and current are transferred as they are."""

    def __init__(self, device: Stoeber5000) -> None:
        self._device = device
        self.leaves = (
            Leaf("actual/velocity", 2.0),
            Leaf("actual/current", 0.1),
            Leaf("command/velocity", 40.0, ("C01",)),
        )

    def settings(self) -> dict[str, float]:
        return {"C01": self._device.device.parameters(0).c01_rpm}

    def values(self) -> tuple[float | None, ...]:
        axis = self._device.axes[0]
        runs = axis.state is AxisState.ENABLED and axis.setpoint
        set_rpm = axis.setpoint * _STEP * self._device.device.parameters(0).c01_rpm if runs else nan
        return axis.speed_rpm, axis.current_a, set_rpm


class Cia402Physics(Physics):
    """The vl mode: numbers are multiples of 604Ch, and bit 10 is that of the mode that 6061h says."""

    def __init__(self, device: Cia402Drive) -> None:
        self._device = device
        factor = ("604C:01", "604C:02")
        self.leaves = (
            Leaf("actual/velocity", 2.0, factor),
            Leaf("actual/mode", 0.5, at_once=True),
            Leaf("actual/target_reached", 0.5, ("6060",), at_once=True, is_bit=True),
            Leaf("command/velocity", 20.0, (*factor, "6060")),
        )

    def settings(self) -> dict[str, float]:
        settings = self._device.settings
        numerator, denominator = settings.vl_dimension
        return {"604C:01": numerator, "604C:02": denominator, "6060": settings.mode}

    def values(self) -> tuple[float | None, ...]:
        axis, settings = self._device.axis, self._device.settings
        numerator, denominator = settings.vl_dimension
        rpm = axis.motor.velocity * 60 / INCREMENTS
        is_vl = settings.mode == Cia402Mode.VELOCITY
        is_there = is_vl and abs(axis.motor.velocity - axis.demand_velocity) <= 1
        number = axis.targets.vl_velocity
        runs = axis.state is Cia402State.ENABLED and axis.control_word & 0x7F == 0x7F and number
        set_rpm = (number * numerator / denominator if runs else nan) if is_vl else None
        return rpm, settings.mode, float(is_there), set_rpm


def physics_of(device: SimulatedDevice, drive: Drive) -> Physics:
    """Those of one drive of a node."""
    match device:
        case NordTu4():
            return NordPhysics(device.drives[int(drive.slot[-1]) - 1])
        case LenzeMotec():
            return LenzePhysics(device)
        case Stoeber5000():
            return StoeberPhysics(device)
        case Cia402Drive():
            return Cia402Physics(device)
        case _:
            raise TypeError(f"{drive.path}: nothing is known of how {device} moves")


def posicon_of(device: SimulatedDevice) -> PosiconPhysics:
    """Of a node with one drive that positions."""
    assert isinstance(device, NordSingle)
    return PosiconPhysics(device.drive)
