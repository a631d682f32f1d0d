"""Settings and their non-volatile memory: power-on, ``save`` and ``load``."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")


class Store(Generic[T]):
    """``current`` is what the node uses; ``saved`` is its EEPROM (BU 2500 §6.7.2, 1010h and 1011h)."""

    def __init__(self, factory: Callable[[], T]) -> None:
        self._factory = factory
        self._saved: T | None = None
        self.current = factory()

    def save(self) -> None:
        self._saved = copy.deepcopy(self.current)

    def forget(self) -> None:
        """ "load": the factory settings come at the next power-on and stay until the next ``save``."""
        self._saved = None

    def power_on(self) -> None:
        self.current = self._factory() if self._saved is None else copy.deepcopy(self._saved)

    def to_factory(self) -> None:
        """Factory settings at once; the EEPROM keeps what it has."""
        self.current = self._factory()
