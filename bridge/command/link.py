"""The drive leg of the watchdog: is this drive's data fresh, and is its node there?

The twin of P513 (BU 2500 §8.1). Pure: told of PDOs and of the node's state, asked for a quality.
"""

from __future__ import annotations

from enum import Enum

from bridge.config import IGNORE_ALL_S
from bridge.image import Quality


class NodeState(Enum):
    """What the southbound side knows of the node behind a drive."""

    ABSENT = "not seen yet"
    BOOTING = "booting"
    OPERATIONAL = "operational"
    LOST = "lost"
    DISABLED = "disabled"
    CONFIG_ERROR = "configuration error"


class Link:
    """Freshness of one drive's process data. Times are monotonic seconds.

    ``pdo_deadline_s`` is the longest regular pause between two TPDOs, known after boot-up, or None
    where the drive sends only changes.
    """

    __slots__ = (
        "_downtime_s",
        "_expired_at",
        "_hold_s",
        "_since",
        "last_pdo",
        "node",
        "pdo_deadline_s",
    )

    def __init__(self, telegram_downtime_s: float, hold_ms: int) -> None:
        self._downtime_s = telegram_downtime_s
        self._hold_s = hold_ms / 1000
        self.node = NodeState.ABSENT
        self.pdo_deadline_s: float | None = None
        self.last_pdo: float | None = None
        self._since: float | None = None  # since when TPDOs may be expected
        self._expired_at: float | None = None

    @property
    def ignores_errors(self) -> bool:
        return self._downtime_s == IGNORE_ALL_S

    @property
    def is_expired(self) -> bool:
        """The telegram downtime has passed without a TPDO."""
        return self._expired_at is not None

    @property
    def may_enable(self) -> bool:
        """Whether enabling commands may go to the drive."""
        if self.ignores_errors:
            return self.node in (NodeState.OPERATIONAL, NodeState.LOST)
        return self.node is NodeState.OPERATIONAL and not self.is_expired

    def on_pdo(self, now: float) -> None:
        self.last_pdo = now
        if self.node is not NodeState.LOST:
            self._expired_at = None

    def on_node(self, state: NodeState, now: float) -> None:
        if state is NodeState.OPERATIONAL and self.node is not NodeState.OPERATIONAL:
            self._since = now
            self._expired_at = None
        if state is NodeState.LOST and self.node is not NodeState.LOST:
            self._expired_at = now if self._expired_at is None else self._expired_at
        self.node = state

    def on_time(self, now: float) -> bool:
        """Judge the telegram downtime; True at the moment it expires."""
        limit = self._downtime_deadline()
        if limit is None or now < limit or self.is_expired:
            return False
        self._expired_at = now
        return True

    def _downtime_deadline(self) -> float | None:
        if self.node is not NodeState.OPERATIONAL or self.pdo_deadline_s is None or self._downtime_s == 0:
            return None
        # "Ignore" still reports, after the shortest time P513 can have.
        downtime_s = max(self._downtime_s, 0.1)
        return self._last_sign() + max(downtime_s, self.pdo_deadline_s)

    def _last_sign(self) -> float:
        return max(self.last_pdo or 0.0, self._since or 0.0)

    def quality(self, now: float) -> Quality:
        match self.node:
            case NodeState.DISABLED:
                return Quality.DISABLED
            case NodeState.CONFIG_ERROR:
                return Quality.CONFIG_ERROR
            case _:
                pass
        if self.last_pdo is None:
            return Quality.WAITING
        if self._expired_at is not None:
            return Quality.DEAD if now >= self._expired_at + self._hold_s else Quality.LOST
        if self.node is not NodeState.OPERATIONAL or self.last_pdo < (self._since or 0.0):
            return Quality.STALE
        if self.pdo_deadline_s is not None and now >= self._last_sign() + self.pdo_deadline_s:
            return Quality.STALE
        return Quality.GOOD

    def next_deadline(self, now: float) -> float | None:
        """When the quality or the expiry changes by itself, or None."""
        if self._expired_at is not None:
            dead = self._expired_at + self._hold_s
            return dead if now < dead else None
        candidates: list[float] = []
        if self.node is NodeState.OPERATIONAL and self.pdo_deadline_s is not None:
            candidates.append(self._last_sign() + self.pdo_deadline_s)
        downtime = self._downtime_deadline()
        if downtime is not None:
            candidates.append(downtime)
        later = [deadline for deadline in candidates if deadline > now]
        return min(later) if later else None

    def age_ms(self, now: float) -> int:
        """Age of the last TPDO; 0xFFFFFFFF where there was none."""
        return 0xFFFF_FFFF if self.last_pdo is None else min(round((now - self.last_pdo) * 1000), 0xFFFF_FFFE)
