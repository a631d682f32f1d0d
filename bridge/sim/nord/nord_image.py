"""The process data that the interface holds between CANopen and the system bus (BU 2500 §6.7.5)."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from bridge.sim.core.dictionary import Dictionary, IntegerType, Number, constant
from bridge.sim.core.dirty_flag import DirtyFlag
from bridge.sim.nord.nord_drive import NordDrive
from bridge.sim.nord.nord_settings import (
    ACTUAL_VALUES,
    CONTROL_WORDS,
    DIGITAL_INPUTS,
    DIGITAL_OUTPUTS,
    DRIVES,
    SETPOINTS,
    STATUS_WORDS,
    Layout,
    values_per_drive,
)


class ProcessImage:
    """Objects 3000h…3005h. Drives are counted from 0.

    ``touched`` collects the drives whose words have been written since it was last fetched.
    """

    def __init__(self, drives: Sequence[NordDrive], online: Callable[[int], bool], layout: Layout) -> None:
        self._drives = drives
        self._online = online
        self._per_drive = values_per_drive(layout)
        self._touched: set[int] = set()
        self.control = [0] * DRIVES
        self.setpoints = [0] * (DRIVES * self._per_drive)
        self.outputs = 0
        self.inputs = 0
        self.dirty = DirtyFlag()

    def clear(self) -> None:
        self.control = [0] * DRIVES
        self.setpoints = [0] * (DRIVES * self._per_drive)
        self.outputs = 0
        self._touched.clear()
        self.dirty.is_set = True

    def take_touched(self) -> list[int]:
        touched = sorted(self._touched)
        self._touched.clear()
        return touched

    def touch(self, drive: int) -> None:
        """A word for this drive has been written elsewhere."""
        self._touched.add(drive)

    def set_outputs(self, value: int) -> None:
        self.outputs = value
        self.dirty.is_set = True

    def setpoints_of(self, drive: int) -> list[int]:
        return self.setpoints[drive * self._per_drive : (drive + 1) * self._per_drive]

    def status(self, drive: int) -> int:
        """For a missing drive the interface has 0, which means "not ready"."""
        return self._drives[drive].status_word if self._online(drive) else 0

    def actual(self, drive: int, value: int) -> int:
        return self._drives[drive].actual_value(value + 1) if self._online(drive) else 0

    def bus_in(self, element: int) -> int:
        """P176: outputs, then control word and three setpoints of each drive."""
        if element == 1:
            return self.outputs
        drive, word = divmod(element - 2, 4)
        return self.control[drive] if word == 0 else self.setpoints_of(drive)[word - 1]

    def bus_out(self, element: int) -> int:
        """P177: inputs, then status word and three actual values of each drive."""
        if element == 1:
            return self.inputs
        drive, word = divmod(element - 2, 4)
        return self.status(drive) if word == 0 else self.actual(drive, word - 1)

    def add_to(self, dictionary: Dictionary) -> None:
        dictionary.add_array(CONTROL_WORDS, [self.control_entry(drive) for drive in range(DRIVES)])
        dictionary.add_array(STATUS_WORDS, [self.status_entry(drive) for drive in range(DRIVES)])
        count = DRIVES * self._per_drive
        dictionary.add_array(SETPOINTS, [self._setpoint_entry(place) for place in range(count)])
        dictionary.add_array(ACTUAL_VALUES, [self._actual_entry(place) for place in range(count)])
        u16 = IntegerType.UNSIGNED16
        outputs = Number(u16, lambda: self.outputs, self.set_outputs, in_rpdo=True, in_tpdo=True)
        dictionary.add(DIGITAL_OUTPUTS, 0, outputs)
        dictionary.add(DIGITAL_INPUTS, 0, Number(u16, lambda: self.inputs, in_tpdo=True))

    def control_entry(self, drive: int) -> Number:
        """The control word of a drive, 3000h or 6040h."""

        def write(value: int) -> None:
            self._touched.add(drive)
            if self.control[drive] != value:
                self.control[drive] = value
                self.dirty.is_set = True

        return Number(IntegerType.UNSIGNED16, lambda: self.control[drive], write, in_rpdo=True, in_tpdo=True)

    def status_entry(self, drive: int) -> Number:
        """The status word of a drive, 3001h or 6041h."""
        return Number(IntegerType.UNSIGNED16, lambda: self.status(drive), in_tpdo=True)

    def _setpoint_entry(self, place: int) -> Number:
        def write(value: int) -> None:
            self._touched.add(place // self._per_drive)
            if self.setpoints[place] != value:
                self.setpoints[place] = value
                self.dirty.is_set = True

        # §6.5.8 maps a control word and a setpoint into 1A00h: an RW object can be mapped both ways.
        return Number(
            IntegerType.UNSIGNED16, lambda: self.setpoints[place], write, in_rpdo=True, in_tpdo=True
        )

    def _actual_entry(self, place: int) -> Number:
        drive, value = divmod(place, self._per_drive)
        return Number(IntegerType.UNSIGNED16, lambda: self.actual(drive, value), in_tpdo=True)


def add_parameter(dictionary: Dictionary, number: int, entries: Sequence[Number]) -> None:
    """A parameter of the interface: sub-indices count from 1 and there is no sub 0 (§7.1)."""
    for sub, entry in enumerate(entries, start=1):
        dictionary.add(0x2000 + number, sub, entry)


def display(read: Callable[[], int]) -> Number:
    """A 16-bit value that can only be read."""
    return Number(IntegerType.UNSIGNED16, read)


def fixed(value: int) -> Number:
    return constant(IntegerType.UNSIGNED16, value)
