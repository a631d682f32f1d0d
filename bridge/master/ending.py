"""End of the service: what did not follow its stop, what is done about it, and the report."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from bridge.command import Action, Commanded, Plant
from bridge.command.commanded import has_followed
from bridge.command.node import Enforcement
from bridge.text import Text, render


@dataclass(frozen=True, slots=True)
class Ending:
    """Drives and outputs at the end: their number, ``commanded``, of which so many are ``drives``, and names.
    ``ignoring`` were heard and do not follow their stop; ``unheard`` were not heard; ``unproven`` are outputs
    whose node does not let them be read, each with the reason. ``nodes_stopped`` get NMT stop, or had it."""

    drives: int = 0
    commanded: int = 0
    ignoring: tuple[str, ...] = ()
    unheard: tuple[str, ...] = ()
    unproven: tuple[str, ...] = ()
    nodes_stopped: tuple[str, ...] = ()

    @property
    def is_good(self) -> bool:
        return not self.ignoring and not self.unheard

    @property
    def lines(self) -> list[str]:
        """Last lines of the log."""
        what = "drives" if self.commanded == self.drives else "drives and outputs"
        lines = [f"forwarded, and not known to be followed: {one}" for one in self.unproven]
        if self.ignoring:
            sent = f"; NMT stop was sent to {', '.join(self.nodes_stopped)}" if self.nodes_stopped else ""
            lines.append(f"NOT STOPPED: {', '.join(self.ignoring)} did not follow the stop{sent}")
        if self.unheard:
            lines.append(f"not heard, may be running or not: {', '.join(self.unheard)}")
        whole = self.commanded
        rest = whole - len(self.ignoring) - len(self.unheard) - len(self.unproven)
        return [
            *lines,
            f"all {what} are stopped" if rest == whole else f"{rest} of {whole} {what} are stopped",
        ]


def waits_for(plant: Plant) -> bool:
    """Whether a drive or output whose node is in operation is not yet known to follow its stop, and may
    be."""
    return any(
        one.stop_check.is_judged and not has_followed(one) and one.unproven is None for one in plant.commanded
    )


def end(plant: Plant, *, can_send: bool = True) -> Ending:
    """Report of the end. A master that has failed (not ``can_send``) sends nothing and hears nobody."""
    ignoring = [one for one in plant.commanded if can_send and _ignores(one)]
    left = [one for one in plant.commanded if one not in ignoring]
    unproven = {one.name: one.unproven for one in left if one.unproven is not None}
    unheard = [
        one.name
        for one in left
        if one.name not in unproven and not (one.stop_check.is_judged and has_followed(one))
    ]
    return Ending(
        len(plant.drives),
        len(plant.commanded),
        tuple(one.name for one in ignoring),
        tuple(unheard),
        tuple(f"{name} ({render(why)})" for name, why in unproven.items()),
        tuple(dict.fromkeys(one.node_name for one in ignoring if _gets_nmt_stop(one))),
    )


def nmt_stops(plant: Plant, ending: Ending) -> Iterator[Enforcement]:
    """NMT stops for the nodes of what has not followed, unless the site file exempts them. Carry out each
    before the next one is taken: a node that is stopped by then gets no other for its next drive."""
    for one in plant.commanded:
        if one.name in ending.ignoring and _gets_nmt_stop(one) and one.stop_check.is_judged:
            yield Enforcement(one.node_name, Action.STOP_NODE, Text.of("stopped_by.end", name=one.name))


def _gets_nmt_stop(one: Commanded) -> bool:
    return one.table.reacts_to_ignored_stop != "report"


def _ignores(one: Commanded) -> bool:
    is_known = one.stop_check.is_judged and one.is_heard
    return not one.stop_check.follows or (is_known and not has_followed(one))
