"""Access to objects on CAN 5000: expedited with four bytes, and by axis (ID 441684.06 §8.2)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from bridge.sim.core.dictionary import Dictionary, Entry, Number

_EXPEDITED_SIZE: Final = 4


@dataclass(frozen=True, slots=True)
class WideNumber(Number):
    """A number that is also written with four bytes, as the examples of §8.1.3 and §8.2.2 do."""

    def download(self, data: bytes) -> None:
        size, signed = self.data_type.size, self.data_type.signed
        if len(data) == _EXPEDITED_SIZE > size:
            value = int.from_bytes(data, "little", signed=signed)
            if self.data_type.decode(data[:size]) == value:
                data = data[:size]
        Number.download(self, data)


class WideDictionary(Dictionary):
    """Every number in it takes four bytes."""

    def add(self, index: int, sub: int, entry: Entry) -> None:
        if type(entry) is Number:
            entry = WideNumber(
                entry.data_type,
                entry.read,
                entry.write,
                entry.low,
                entry.high,
                entry.in_rpdo,
                entry.in_tpdo,
            )
        super().add(index, sub, entry)


class AxisView(Dictionary):
    """The device's objects with the parameters of one axis, chosen anew at each access."""

    def __init__(self, device: Dictionary, axes: Sequence[Dictionary], axis: Callable[[], int]) -> None:
        super().__init__()
        self._device = device
        self._axes = tuple(axes)
        self._axis = axis

    def add(self, index: int, sub: int, entry: Entry) -> None:
        self._device.add(index, sub, entry)

    def has_object(self, index: int) -> bool:
        return self._axes[0].has_object(index) or self._device.has_object(index)

    def find(self, index: int, sub: int) -> Entry:
        own = self._axes[self._axis()]
        return (own if own.has_object(index) else self._device).find(index, sub)
