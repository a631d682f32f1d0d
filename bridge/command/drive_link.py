"""Drive leg of the watchdog: freshness of a drive's data, and presence of its node.

The twin of P513 (BU 2500 §8.1). Pure: told of PDOs and of the node's state, asked for a quality.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from bridge.catalogue.codes import NodeState as NodeState
from bridge.config import IGNORE_ALL_S
from bridge.image import Quality
from bridge.text import Said, Text

REASONS: Final = {
    state: Text.of("quality.node", state=Text.word("node_state", state.value)) for state in NodeState
}
"""Reasons why points are not good, by the state of their node."""
_NO_DATA: Final = Text.of("watchdog.no_process_data")


@dataclass(slots=True)
class FurtherTpdo:
    """A TPDO other than the one with the status word: its values have an age of their own.

    ``places`` are those of its words in ``process.tpdo``; ``deadline_s`` is the longest regular pause
    between two of them, None if it is sent on change only.
    """

    name: str
    places: frozenset[int]
    deadline_s: float | None
    last: float | None = None
    quality: Quality = Quality.WAITING

    def on_data(self, now: float) -> bool:
        """Take note of its arrival; returns True if its values were not good before."""
        self.last = now
        was_good = self.quality is Quality.GOOD
        self.quality = Quality.GOOD
        return not was_good

    def on_time(self, now: float) -> bool:
        """Judge its deadline; returns True at the moment it passes."""
        if self.quality is not Quality.GOOD or self.is_fresh(now):
            return False
        self.quality = Quality.STALE
        return True

    def is_fresh(self, now: float) -> bool:
        """It has arrived since the boot-up, and is not late."""
        if self.quality is not Quality.GOOD or self.last is None:
            return False
        return self.deadline_s is None or now < self.last + self.deadline_s


class DriveLink:
    """Freshness of one drive's process data. Times are monotonic seconds.

    ``pdo_deadline_s`` is the longest regular pause between two TPDOs with the status word, None before
    boot-up and where the drive sends only changes. ``further`` are the TPDOs beside it.
    """

    def __init__(self, telegram_downtime_s: float, hold_ms: int) -> None:
        self._downtime_s = telegram_downtime_s
        self._hold_s = hold_ms / 1000
        self.node = NodeState.ABSENT
        self.why_unsent: Said = ""
        """Reason why nothing that belongs on the bus is repeated there; empty where it is."""
        self.pdo_deadline_s: float | None = None
        self.further: Sequence[FurtherTpdo] = ()
        self.last_pdo: float | None = None
        self._since = float("-inf")  # since when TPDOs may be expected
        self._expired_at: float | None = None
        self._judged_at = float("-inf")

    @property
    def ignores_errors(self) -> bool:
        return self._downtime_s == IGNORE_ALL_S

    @property
    def is_expired(self) -> bool:
        """The telegram downtime has passed without a TPDO, or the node is lost."""
        return self._expired_at is not None

    @property
    def is_heard(self) -> bool:
        """A TPDO came since the node is operational."""
        return self.last_pdo is not None and self.last_pdo >= self._since

    @property
    def may_enable(self) -> bool:
        """Whether enabling commands may go to the drive."""
        if self.ignores_errors:
            return self.node in (NodeState.OPERATIONAL, NodeState.LOST)
        return self.node is NodeState.OPERATIONAL and self._expired_at is None

    def brings_forward(self, now: float) -> bool:
        """Whether a TPDO at ``now`` may bring an earlier deadline than the present one: the last TPDO has
        been judged late, or has a later time."""
        deadline_s, since, last = self.pdo_deadline_s, self._since, self.last_pdo
        # Asked with every PDO: no call.
        last_sign = since if last is None or last < since else last
        return deadline_s is not None and (last_sign + deadline_s <= self._judged_at or now < last_sign)

    def on_boot(self, pdo_deadline_s: float | None, further: Sequence[FurtherTpdo]) -> None:
        """Take over the findings of the boot-up."""
        self.pdo_deadline_s, self.further = pdo_deadline_s, further

    def on_pdo(self, now: float) -> bool:
        """Take note of a TPDO; returns True where it ends an expiry."""
        self.last_pdo = now
        if self._expired_at is None or self.node is NodeState.LOST:
            return False
        self._expired_at = None
        return True

    def on_node(self, state: NodeState, now: float) -> None:
        before, self.node = self.node, state
        if state is before:
            return
        match state:
            case NodeState.OPERATIONAL:
                self._since = now
                self._expired_at = None
            case NodeState.LOST:
                self._expired_at = now if self._expired_at is None else self._expired_at
            case NodeState.DISABLED:  # what it said before says nothing about when it is back
                self.last_pdo = None
                self._expired_at = None
            case _:
                pass

    def on_time(self, now: float) -> bool:
        """Judge the telegram downtime; returns True at the moment it expires."""
        self._judged_at = max(now, self._judged_at)
        limit = self._downtime_deadline()
        if limit is None or now < limit or self._expired_at is not None:
            return False
        self._expired_at = now
        return True

    def _stale_deadline(self) -> float | None:
        if self.node is not NodeState.OPERATIONAL or self.pdo_deadline_s is None:
            return None
        return self._last_sign() + self.pdo_deadline_s

    def _downtime_deadline(self) -> float | None:
        if self.node is not NodeState.OPERATIONAL or self.pdo_deadline_s is None or self._downtime_s == 0:
            return None
        # "Ignore" still reports, after the shortest time P513 can have.
        downtime_s = max(self._downtime_s, 0.1)
        return self._last_sign() + max(downtime_s, self.pdo_deadline_s)

    def is_fresh(self, now: float) -> bool:
        """The drive is heard, and no TPDO of it is late."""
        if self.last_pdo is None or not self.is_heard:
            return False
        return self.pdo_deadline_s is None or now < self.last_pdo + self.pdo_deadline_s

    def _last_sign(self) -> float:
        return self._since if self.last_pdo is None else max(self.last_pdo, self._since)

    def quality(self, now: float) -> Quality:
        """Quality of the drive's data at ``now``."""
        node, last_pdo, deadline_s = self.node, self.last_pdo, self.pdo_deadline_s
        if node is NodeState.OPERATIONAL and last_pdo is not None and self._expired_at is None:
            # First, because it is asked with every PDO.
            fresh = last_pdo >= self._since and (deadline_s is None or now < last_pdo + deadline_s)
            return Quality.GOOD if fresh else Quality.STALE
        if node is NodeState.DISABLED:
            return Quality.DISABLED
        if node is NodeState.CONFIG_ERROR:
            return Quality.CONFIG_ERROR
        if last_pdo is None:
            return Quality.WAITING
        if self._expired_at is not None:
            return Quality.DEAD if now >= self._expired_at + self._hold_s else Quality.LOST
        return Quality.STALE

    def why_lacking(self, places: frozenset[int], now: float) -> Said:
        """Reason why these words, by their places in ``process.tpdo``, are not known; empty where they are.
        The TPDO with the status word is judged by ``quality``."""
        late = [pdo.name for pdo in self.further if not (pdo.places.isdisjoint(places) or pdo.is_fresh(now))]
        return Text.of("quality.no_pdo", pdo=late[0]) if late else ""

    def reason(self, quality: Quality) -> Said:
        """Reason for this quality of the data, in a few words; empty where they are good."""
        if quality is Quality.GOOD:
            return ""
        if self.node is not NodeState.OPERATIONAL:
            return REASONS[self.node]
        return _NO_DATA

    def next_deadline(self) -> float | None:
        """Time at which the quality or the expiry changes by itself, beyond what ``on_time`` has judged."""
        if self._expired_at is not None:
            times = (self._expired_at + self._hold_s,)
        else:
            times = (self._stale_deadline(), self._downtime_deadline())
        ahead = [time for time in times if time is not None and time > self._judged_at]
        return min(ahead) if ahead else None

    def age_ms(self, now: float) -> int:
        """Age of the last TPDO in ms; 0xFFFFFFFF where there was none."""
        if self.last_pdo is None:
            return 0xFFFF_FFFF
        return min(max(0, round((now - self.last_pdo) * 1000)), 0xFFFF_FFFE)
