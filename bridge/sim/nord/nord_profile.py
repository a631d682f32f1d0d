"""The drive profile DS-402 of a bus interface SK xU4-CAO: velocity mode (BU 2500 §6.7.3, §7.1.2 P168)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from bridge.sim.core.dictionary import Dictionary, Entry, IntegerType, Number, item
from bridge.sim.core.store import Store
from bridge.sim.nord.nord_drive import NordDrive
from bridge.sim.nord.nord_faults import emcy_code
from bridge.sim.nord.nord_image import ProcessImage
from bridge.sim.nord.nord_ramp import POLE_PAIRS, Demand
from bridge.sim.nord.nord_settings import DRIVES, InterfaceSettings

PROFILE_STEP: Final = 0x800
"""Distance between the objects of two drives: §6.7.1 has eight profiles in 6000h…9FFFh."""
_PROFILE: Final = range(0x6000, 0xA000)
_REPLACED: Final = range(0x3000, 0x3006)
_RPM_PER_HZ: Final = 60 / POLE_PAIRS
_MOST_P168: Final = 16383
_PER_DRIVE: Final = 4
_IO_SHIFT: Final = 16
"""60FDh and 60FEh have inputs and outputs from bit 16 on."""


class ProfileDictionary(Dictionary):
    """A dictionary that has either the objects of the profile or 3000h…3005h."""

    def __init__(self, hides: Callable[[int], bool]) -> None:
        super().__init__()
        self._hides = hides

    def has_object(self, index: int) -> bool:
        return not self._hides(index) and super().has_object(index)

    def find(self, index: int, sub: int) -> Entry:
        """The entry, if the object exists at present."""
        return super().find(-1 if self._hides(index) else index, sub)


class VelocityMode:
    """603Fh…6049h of each drive, 60FDh and 60FEh of the interface. Drives are counted from 0."""

    def __init__(
        self,
        drives: Sequence[NordDrive],
        online: Callable[[int], bool],
        image: ProcessImage,
        store: Store[InterfaceSettings],
    ) -> None:
        self._drives = drives
        self._online = online
        self._image = image
        self._store = store
        self._targets_rpm = [0] * DRIVES

    @property
    def is_on(self) -> bool:
        return self._store.current.profile[0] != 0

    def hides(self, index: int) -> bool:
        """Whether this object does not exist at present: one of the profile while that is off, or one that it
        replaces."""
        return index in (_REPLACED if self.is_on else _PROFILE)

    def clear(self) -> None:
        self._targets_rpm = [0] * DRIVES

    def demand(self, place: int) -> Demand:
        """The drive's demand: 6042h within 6046h, with the ramps in 6048h and 6049h."""
        settings = self._store.current
        target = self._targets_rpm[place]
        if target:
            rpm = min(max(abs(target), settings.velocity_min[place]), settings.velocity_max[place])
            target = rpm if target > 0 else -rpm
        return Demand(target / _RPM_PER_HZ, self._ramp_s(place, 0), self._ramp_s(place, 2))

    def add_to(self, dictionary: Dictionary) -> None:
        for place in range(DRIVES):
            self._add_drive(dictionary, place)

        def set_outputs(value: int) -> None:
            self._image.set_outputs(value >> _IO_SHIFT)

        u32 = IntegerType.UNSIGNED32
        dictionary.add(0x60FD, 0, Number(u32, lambda: self._image.inputs << _IO_SHIFT, in_tpdo=True))
        outputs = Number(
            u32, lambda: self._image.outputs << _IO_SHIFT, set_outputs, in_rpdo=True, in_tpdo=True
        )
        dictionary.add(0x60FE, 0, outputs)

    def _add_drive(self, dictionary: Dictionary, place: int) -> None:
        base = PROFILE_STEP * place
        drive, image = self._drives[place], self._image

        def speed() -> int:
            return round(drive.output_hz * _RPM_PER_HZ) if self._online(place) else 0

        def set_target(value: int) -> None:
            image.touch(place)
            if self._targets_rpm[place] != value:
                self._targets_rpm[place] = value
                image.dirty.is_set = True

        def error() -> int:
            fault = drive.fault_tenths if self._online(place) else 0
            return emcy_code(fault) if fault else 0

        u16, i16, u32 = IntegerType.UNSIGNED16, IntegerType.INTEGER16, IntegerType.UNSIGNED32
        objects = {
            0x603F: Number(u32, error, in_tpdo=True),
            0x6040: image.control_entry(place),
            0x6041: image.status_entry(place),
            0x6042: Number(i16, lambda: self._targets_rpm[place], set_target, in_rpdo=True, in_tpdo=True),
            # The simulated motor follows its ramp: demand and actual speed are one.
            0x6043: Number(i16, speed, in_tpdo=True),
            0x6044: Number(i16, speed, in_tpdo=True),
        }
        for index, entry in objects.items():
            dictionary.add(base + index, 0, entry)
        settings = self._store
        low = item(u32, lambda: settings.current.velocity_min, place)
        high = item(u32, lambda: settings.current.velocity_max, place)
        dictionary.add_array(base + 0x6046, [low, high])
        for index, first in ((0x6048, 0), (0x6049, 2)):
            at = 1 + _PER_DRIVE * place + first
            speeds = item(u32, lambda: settings.current.profile, at, 0, _MOST_P168)
            times = item(u16, lambda: settings.current.profile, at + 1, 0, _MOST_P168)
            dictionary.add_array(base + index, [speeds, times])

    def _ramp_s(self, place: int, first: int) -> float | None:
        """The time between 0 and P105 by P168; None if it defines no change of speed."""
        at = 1 + _PER_DRIVE * place + first
        delta_rpm, delta_s = self._store.current.profile[at : at + 2]
        if not delta_rpm:
            return None
        return self._drives[place].parameters.value(105) * _RPM_PER_HZ / delta_rpm * delta_s
