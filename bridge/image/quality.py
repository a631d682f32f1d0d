"""Quality of a point: one model that every protocol renders in its own way."""

from __future__ import annotations

from enum import IntEnum


class Quality(IntEnum):
    """Numbered as Modbus serves it (input register 11)."""

    WAITING = 0
    """No data since start."""
    GOOD = 1
    STALE = 2
    """The TPDO's deadline passed while the node is alive."""
    LOST = 3
    """Heartbeat or guarding lost; the last value is kept for ``hold_ms``."""
    DEAD = 4
    """Lost for longer than ``hold_ms``."""
    DEVICE_FAULT = 5
    """The drive itself says that this value is not valid."""
    DISABLED = 6
    CONFIG_ERROR = 7
    """The mapping could not be applied to what the node has."""

    @property
    def label(self) -> str:
        return self.name.lower()

    @property
    def has_value(self) -> bool:
        """Whether a last value is served beside this quality."""
        return self in (Quality.GOOD, Quality.STALE, Quality.LOST, Quality.DEVICE_FAULT)
