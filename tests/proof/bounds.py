"""Until when a drive has to be stopped, in ms: on the bus, and by its own word, which may be TPDO_MS late."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from tests.proof.drives import CLIENT_MS, TPDO_MS, Drive
from tests.proof.rig import Rig
from tests.proof.settings import PLANT, REACTION_MS

_BOOT_MS: Final = 1500.0

Bound = Callable[[Rig, Drive], float]


def controller(rig: Rig, drive: Drive) -> float:
    """What is published; what comes after the RPDO, such as SYNC, is none of the bus's time."""
    return min(rig.worst_case_ms[drive], PLANT.fieldbus_timeout_ms + at_once(rig, drive))


def controller_drive(rig: Rig, drive: Drive) -> float:
    stopped_ms = rig.worst_case_ms[drive]
    if drive.reaction == "silence":
        stopped_ms = controller(rig, drive) + drive.family.own_timeout_ms
    return stopped_ms + TPDO_MS


def controller_and_bridge_drive(rig: Rig, drive: Drive) -> float:
    """Both fall silent: the drive has to see it by itself."""
    return controller(rig, drive) + drive.family.own_timeout_ms + TPDO_MS


def dead(rig: Rig, drive: Drive) -> float:
    return PLANT.deadman_ms


def dead_drive(rig: Rig, drive: Drive) -> float:
    return rig.worst_case_bridge_ms[drive] + TPDO_MS


def at_once(rig: Rig, drive: Drive) -> float:
    return PLANT.rpdo_period_ms + REACTION_MS


def at_once_drive(rig: Rig, drive: Drive) -> float:
    return at_once(rig, drive) + TPDO_MS


def node_stopped(rig: Rig, drive: Drive) -> float:
    """The bridge stops the node at once; its heartbeat says so."""
    return at_once(rig, drive) + PLANT.heartbeat_ms


def asked(rig: Rig, drive: Drive) -> float:
    """The way of what asks for it, and the stop."""
    return CLIENT_MS + at_once(rig, drive)


def asked_drive(rig: Rig, drive: Drive) -> float:
    return asked(rig, drive) + TPDO_MS


def gone_drive(rig: Rig, drive: Drive) -> float:
    return at_once(rig, drive) + drive.family.own_timeout_ms + TPDO_MS


def booted_drive(rig: Rig, drive: Drive) -> float:
    """The bridge boots it anew, and its TPDOs come after that."""
    return gone_drive(rig, drive) + _BOOT_MS


def lost(rig: Rig, drive: Drive) -> float:
    return drive.family.lost_after_ms + at_once(rig, drive)


def lost_drive(rig: Rig, drive: Drive) -> float:
    return lost(rig, drive) + TPDO_MS


def given_way(seconds: float) -> Bound:
    """The bridge is back then, stops the drive and its node, and leaves the bus. The node's heartbeat says
    so; a guarded one is not asked any more, and speaks when its own time is up."""

    def bound(rig: Rig, drive: Drive) -> float:
        stopped_ms = seconds * 1000 + node_stopped(rig, drive)
        own_ms = drive.family.own_timeout_ms + at_once(rig, drive)
        return max(stopped_ms, own_ms) if drive.family.is_guarded else stopped_ms

    return bound


def after(seconds: float) -> Bound:
    """The bridge is back then, and stops the drive."""
    return lambda rig, drive: seconds * 1000 + at_once_drive(rig, drive)
