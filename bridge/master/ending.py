"""The end of the service: which drives did not follow their stop, what is done about them, and the report."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from bridge.command import Action, Drive, Plant
from bridge.command.follow import LastStop
from bridge.command.plant import Enforce
from bridge.image import Quality


@dataclass(frozen=True, slots=True)
class Ending:
    """Names of drives. ``ignoring`` were heard and do not follow their stop; ``unheard`` were not heard."""

    drives: int = 0
    ignoring: tuple[str, ...] = ()
    unheard: tuple[str, ...] = ()
    nodes_stopped: tuple[str, ...] = ()

    @property
    def is_good(self) -> bool:
        return not self.ignoring and not self.unheard

    @property
    def lines(self) -> list[str]:
        """The last lines of the log."""
        if self.is_good:
            return ["all drives are stopped"]
        lines: list[str] = []
        if self.ignoring:
            sent = f"; NMT stop was sent to {', '.join(self.nodes_stopped)}" if self.nodes_stopped else ""
            lines.append(f"NOT STOPPED: {', '.join(self.ignoring)} did not follow the stop{sent}")
        if self.unheard:
            lines.append(f"not heard, may be running or not: {', '.join(self.unheard)}")
        rest = self.drives - len(self.ignoring) - len(self.unheard)
        return [*lines, f"{rest} of {self.drives} drives are stopped"]


def waits_for(plant: Plant) -> bool:
    """Whether a drive whose node is in operation has not said yet that it follows its stop."""
    return any(drive.following.is_judged and not _has_followed(drive) for drive in plant.drives.values())


def end(plant: Plant, now: float, enforce: Enforce, *, can_send: bool = True) -> Ending:
    """NMT stop for the nodes of drives that have not followed, unless the site file exempts them. A master
    that has failed (not ``can_send``) sends nothing and hears nobody."""
    ignoring = [drive for drive in plant.drives.values() if can_send and _ignores(drive)]
    unheard = [
        drive.name
        for drive in plant.drives.values()
        if drive not in ignoring and not (drive.following.is_judged and _has_followed(drive))
    ]
    return Ending(
        len(plant.drives),
        tuple(drive.name for drive in ignoring),
        tuple(unheard),
        tuple(dict.fromkeys(_stopped(ignoring, now, enforce))),
    )


def _stopped(ignoring: list[Drive], now: float, enforce: Enforce) -> Iterator[str]:
    why = "the bridge at its end: {} does not follow its stop"
    for drive in ignoring:
        if drive.table.reacts_to_ignored_stop != "report":
            if drive.following.is_judged:
                enforce(drive.node_name, Action.STOP_NODE, why.format(drive.name), now)
            yield drive.node_name


def _has_followed(drive: Drive) -> bool:
    return drive.following.last_stop is LastStop.FOLLOWED


def _ignores(drive: Drive) -> bool:
    is_heard = drive.following.is_judged and drive.quality is Quality.GOOD
    return not drive.following.follows or (is_heard and not _has_followed(drive))
