"""Who may command a drive: the twin of P509/P510 (BU 2500 §7.2).

With ``control`` a protocol, the first identity of that protocol whose valid telegram arrives owns the drive
until it releases it or falls silent. With ``"lease"`` any operator takes the drive for a time and keeps it by
going on; with ``"none"`` nobody commands it.
"""

from __future__ import annotations

from typing import Final

from bridge.command.leg.state import Owner
from bridge.command.request import Identity, Role

GONE_S: Final = 10.0
"""Without a watchdog: after this an owner that gives no sign holds nobody up any more. Long enough for one
that connects anew for each telegram, and for a person who was stopped."""


def refusal(control: str, owner: Owner, identity: Identity, *, owner_is_silent: bool) -> str:
    """Why ``identity`` may not command the drive now, in one sentence; empty where it may."""
    if identity.role < Role.OPERATOR:
        return f"{identity} may only read"
    if control == "none":
        return "the site file gives nobody control of this drive"
    if identity.is_same(owner.identity):
        return ""
    if control == "lease":
        if owner.identity is None:
            return "take control of the drive first"
        return f"the drive is controlled by {owner.identity}"
    if identity.source.label != control:
        return f"the drive is controlled by {control}"
    if owner.identity is None or owner_is_silent:
        return ""
    return f"the drive is controlled by {owner.identity}"


def take_refusal(control: str, owner: Owner, identity: Identity, *, owner_is_silent: bool) -> str:
    """Why ``identity`` may not take control now, empty where it may. An engineer always may."""
    if control != "lease":
        may_break = identity.role >= Role.ENGINEER and identity.source.label == control
        return "" if may_break else refusal(control, owner, identity, owner_is_silent=owner_is_silent)
    if identity.role < Role.OPERATOR:
        return f"{identity} may only read"
    free = owner.identity is None or owner_is_silent or identity.is_same(owner.identity)
    if free or identity.role >= Role.ENGINEER:
        return ""
    return f"the drive is controlled by {owner.identity}"


def is_gone(owner: Owner, now: float) -> bool:
    """The owner has had no connection for ``GONE_S``, or not answered to a stop for so long."""
    absent, stopped = owner.absent_until, owner.stopped_until
    return (absent is not None and now >= absent) or (stopped is not None and now >= stopped)
