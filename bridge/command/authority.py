"""Who may command a drive: the twin of P509/P510 (BU 2500 §7.2)."""

from __future__ import annotations

from typing import Final

from bridge.command.request import Identity, Role

GONE_S: Final = 10.0
"""Without a watchdog: after this an owner that gives no sign holds nobody up any more. Long enough for one
that connects anew for each telegram, and for a person who was stopped."""


class Authority:
    """One drive's control source and its present owner.

    With ``control`` a protocol, the first identity of that protocol whose valid telegram arrives owns
    the drive until it releases it or falls silent. With ``"lease"`` any operator takes the drive for a
    time and keeps it by going on; with ``"none"`` nobody commands it.
    """

    __slots__ = ("_absent_until", "_lease_s", "_lease_until", "_stopped_until", "control", "owner")

    def __init__(self, control: str) -> None:
        self.control = control
        self.owner: Identity | None = None
        self._lease_s = 0.0
        self._lease_until: float | None = None
        self._absent_until: float | None = None
        """The owner has no connection any more: from then on it is gone."""
        self._stopped_until: float | None = None
        """Somebody else has stopped its drive, and it has sent nothing since: from then on it is gone."""

    def refusal(self, identity: Identity, *, owner_is_silent: bool) -> str | None:
        """Why ``identity`` may not command the drive now, in one sentence, or None if it may."""
        if identity.role < Role.OPERATOR:
            return f"{identity} may only read"
        if self.control == "none":
            return "the site file gives nobody control of this drive"
        if identity.is_same(self.owner):
            return None
        if self.control == "lease":
            if self.owner is None:
                return "take control of the drive first"
            return f"the drive is controlled by {self.owner}"
        if identity.source.label != self.control:
            return f"the drive is controlled by {self.control}"
        if self.owner is None or owner_is_silent:
            return None
        return f"the drive is controlled by {self.owner}"

    def take_refusal(self, identity: Identity, *, owner_is_silent: bool) -> str | None:
        """Why ``identity`` may not take control now, or None if it may. An engineer always may."""
        if self.control != "lease":
            why = self.refusal(identity, owner_is_silent=owner_is_silent)
            may_break = identity.role >= Role.ENGINEER and identity.source.label == self.control
            return None if may_break else why
        if identity.role < Role.OPERATOR:
            return f"{identity} may only read"
        free = self.owner is None or owner_is_silent or identity.is_same(self.owner)
        if free or identity.role >= Role.ENGINEER:
            return None
        return f"the drive is controlled by {self.owner}"

    def take(self, identity: Identity, now: float, lease_s: float | None = None) -> bool:
        """Make ``identity`` the owner; True where that is a change of owner."""
        changed = not identity.is_same(self.owner)
        self.owner = identity
        if self.control == "lease" and lease_s is not None:
            self._lease_s = lease_s
        self.renew(now)
        return changed

    def renew(self, now: float) -> None:
        """The owner has shown that it is there: its lease runs anew."""
        self._lease_until = now + self._lease_s if self.control == "lease" else None
        self._absent_until = self._stopped_until = None

    def release(self) -> None:
        self.owner = None
        self._lease_until = self._absent_until = self._stopped_until = None

    # an owner that nobody watches

    def on_stop_by_another(self, now: float) -> None:
        """Whoever is there answers to a stop of its drive."""
        if self._stopped_until is None and self.owner is not None:
            self._stopped_until = now + GONE_S

    def on_connection(self, identity: Identity, now: float, *, is_there: bool) -> None:
        """``identity`` has its first connection, or none any more."""
        if identity.is_same(self.owner):
            self._absent_until = None if is_there else now + GONE_S

    def owner_is_gone(self, now: float) -> bool:
        """The owner has had no connection for ``GONE_S``, or not answered to a stop for so long."""
        times = (self._absent_until, self._stopped_until)
        return any(time is not None and now >= time for time in times)

    def next_deadline(self) -> float | None:
        return self._lease_until

    def lease_is_over(self, now: float) -> bool:
        return self._lease_until is not None and now >= self._lease_until
