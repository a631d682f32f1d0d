"""The end of the service: what did not follow its stop, what is done about it, and the report."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from bridge.command import Action, Drive, Plant
from bridge.command.node import Enforce
from bridge.command.outputs import Outputs
from bridge.command.stop_check.state import LastStop
from bridge.image import Quality
from bridge.text import render


@dataclass(frozen=True, slots=True)
class Ending:
    """How many drives there are, and nodes with ``outputs``; and names of both. ``ignoring`` were heard and
    do not follow their stop; ``unheard`` were not heard; ``unproven`` are outputs whose node does not let
    them be read, each with the reason."""

    drives: int = 0
    outputs: int = 0
    ignoring: tuple[str, ...] = ()
    unheard: tuple[str, ...] = ()
    unproven: tuple[str, ...] = ()
    nodes_stopped: tuple[str, ...] = ()

    @property
    def is_good(self) -> bool:
        return not self.ignoring and not self.unheard

    @property
    def lines(self) -> list[str]:
        """The last lines of the log."""
        what = "drives and outputs" if self.outputs else "drives"
        lines = [f"forwarded, and not known to be followed: {one}" for one in self.unproven]
        if self.ignoring:
            sent = f"; NMT stop was sent to {', '.join(self.nodes_stopped)}" if self.nodes_stopped else ""
            lines.append(f"NOT STOPPED: {', '.join(self.ignoring)} did not follow the stop{sent}")
        if self.unheard:
            lines.append(f"not heard, may be running or not: {', '.join(self.unheard)}")
        whole = self.drives + self.outputs
        rest = whole - len(self.ignoring) - len(self.unheard) - len(self.unproven)
        return [
            *lines,
            f"all {what} are stopped" if rest == whole else f"{rest} of {whole} {what} are stopped",
        ]


def waits_for(plant: Plant) -> bool:
    """Whether something whose node is in operation is not known yet to follow its stop, and may be."""
    return any(
        one.stop_check.is_judged and not _has_followed(one) and not _is_unproven(one)
        for one in plant.commanded
    )


def end(plant: Plant, now: float, enforce: Enforce, *, can_send: bool = True) -> Ending:
    """NMT stop for the nodes of what has not followed, unless the site file exempts them. A master that has
    failed (not ``can_send``) sends nothing and hears nobody."""
    ignoring = [one for one in plant.commanded if can_send and _ignores(one)]
    left = [one for one in plant.commanded if one not in ignoring]
    unproven = [one for one in left if isinstance(one, Outputs) and _is_unproven(one)]
    unheard = [
        one.name
        for one in left
        if one not in unproven and not (one.stop_check.is_judged and _has_followed(one))
    ]
    return Ending(
        len(plant.drives),
        len(plant.commanded) - len(plant.drives),
        tuple(one.name for one in ignoring),
        tuple(unheard),
        tuple(f"{one.name} ({render(one.stop_check.why)})" for one in unproven),
        tuple(dict.fromkeys(_stopped(ignoring, now, enforce))),
    )


def _stopped(ignoring: Sequence[Drive | Outputs], now: float, enforce: Enforce) -> Iterator[str]:
    why = "the bridge at its end: {} does not follow its stop"
    for one in ignoring:
        if one.table.reacts_to_ignored_stop != "report":
            if one.stop_check.is_judged:
                enforce(one.node_name, Action.STOP_NODE, why.format(one.name), now)
            yield one.node_name


def _has_followed(one: Drive | Outputs) -> bool:
    return one.stop_check.last_stop is LastStop.FOLLOWED


def _is_unproven(one: Drive | Outputs) -> bool:
    """The node has refused to let the outputs be read: nothing more will be known of them."""
    return isinstance(one, Outputs) and one.stop_check.is_stuck


def _ignores(one: Drive | Outputs) -> bool:
    if isinstance(one, Outputs):
        return not one.stop_check.follows
    is_heard = one.stop_check.is_judged and one.quality is Quality.GOOD
    return not one.stop_check.follows or (is_heard and not _has_followed(one))
