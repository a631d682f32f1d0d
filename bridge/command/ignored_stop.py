"""Consequences of a stop that a drive or the outputs of a node have followed or ignored: audit log, event,
NMT."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from bridge.command.commanded import Commanded
from bridge.command.messages.event import Event, EventKind
from bridge.command.messages.request import Action
from bridge.command.node import Node
from bridge.command.stop_check.state import LastStop, StopVerdict
from bridge.text import Text

_WORST: Final = 1000
"""The highest severity there is (OPC UA Part 5 §6.4.2)."""


@dataclass(frozen=True, slots=True)
class Conclusion:
    """Consequences of a verdict: ``logged`` goes to the audit log, ``event`` to people (None: it is of no
    interest), and ``action`` is taken on the node in the bridge's own name."""

    logged: Text
    event: Event | None = None
    action: Action | None = None


def concluded(node: Node, one: Commanded, verdict: StopVerdict, now: float) -> Conclusion:
    """Consequences of how the last stop of ``one`` has ended."""
    took_s = verdict.at - verdict.since
    if verdict.outcome is not LastStop.IGNORED:
        logged = Text.of("stop.done_after", took_s=took_s)
        if verdict.before is not LastStop.IGNORED:
            return Conclusion(logged)
        return Conclusion(logged, _event(one, 300, Text.of("stop.follows_after_all", says=one.says), now))
    what = one.why_ignored(verdict, took_s)
    if verdict.is_cut_off:
        # What can be done has been done: its node has been told to stop, and takes no more words.
        return Conclusion(what, _event(one, _WORST, what, now))
    action = _reaction(one, verdict)
    said = Text.of("stop.ignored_and_done", what=what, done=_done(action, node, one))
    return Conclusion(said, _event(one, _WORST, said, now), action)


def _event(one: Commanded, severity: int, said: Text, now: float) -> Event:
    return Event(now, EventKind.WATCHDOG, one.name, severity, said)


def _reaction(one: Commanded, verdict: StopVerdict) -> Action | None:
    match one.table.reacts_to_ignored_stop:
        case "report":
            return None
        case "reset_node" if not verdict.again:
            return Action.RESET
        case _:
            return Action.STOP_NODE


def _done(action: Action | None, node: Node, one: Commanded) -> Text:
    if action is None:
        return Text.of("stop.reported_only")
    others = ", ".join(other.slot.name for other in node.drives if other is not one)
    if action is Action.RESET:
        if others:
            return Text.of("stop.nmt_reset_others", node=node.name, others=others)
        return Text.of("stop.nmt_reset", node=node.name)
    if others:
        return Text.of("stop.nmt_stop_others", node=node.name, others=others)
    return Text.of("stop.nmt_stop", node=node.name)
