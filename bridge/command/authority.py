"""Who may command a drive: the twin of P509/P510 (BU 2500 §7.2)."""

from __future__ import annotations

from bridge.command.request import Identity, Role


class Authority:
    """One drive's control source and its present owner.

    With ``control`` a protocol, the first identity of that protocol whose valid telegram arrives owns
    the drive until it releases it or falls silent. With ``"lease"`` any operator takes the drive for a
    time and keeps it by going on; with ``"none"`` nobody commands it.
    """

    __slots__ = ("_lease_s", "_lease_until", "control", "owner")

    def __init__(self, control: str) -> None:
        self.control = control
        self.owner: Identity | None = None
        self._lease_s = 0.0
        self._lease_until: float | None = None

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

    def release(self) -> None:
        self.owner = None
        self._lease_until = None

    def next_deadline(self) -> float | None:
        return self._lease_until

    def lease_is_over(self, now: float) -> bool:
        return self._lease_until is not None and now >= self._lease_until
