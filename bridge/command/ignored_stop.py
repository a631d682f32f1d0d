"""Consequences of a stop that a drive or the outputs of a node have followed or ignored: audit log, event,
NMT."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from bridge.command.drive import Drive
from bridge.command.messages.event import Event, Kind
from bridge.command.messages.request import Action
from bridge.command.node import Node
from bridge.command.outputs import Outputs
from bridge.command.stop_check.state import LastStop, Verdict
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


def concluded(node: Node, one: Drive | Outputs, verdict: Verdict, now: float) -> Conclusion:
    """Consequences of how the last stop of ``one`` has ended."""
    took_s = verdict.at - verdict.since
    if verdict.outcome is not LastStop.IGNORED:
        logged = Text.of("stop.done_after", took_s=took_s)
        if verdict.before is not LastStop.IGNORED:
            return Conclusion(logged)
        says = _heard(one) if isinstance(one, Drive) else Text.of("stop.outputs_as_sent")
        return Conclusion(logged, _event(one, 300, Text.of("stop.follows_after_all", says=says), now))
    if verdict.is_cut_off and isinstance(one, Drive):
        # What can be done has been done: its node has been told to stop, and takes no more words.
        said = _cut_off(node, one, took_s)
        return Conclusion(said, _event(one, _WORST, said, now))
    action = _reaction(one, verdict)
    what = _of_drive(one, verdict, took_s) if isinstance(one, Drive) else _of_outputs(one, verdict, took_s)
    said = Text.of("stop.ignored_and_done", what=what, done=_done(action, node, one))
    return Conclusion(said, _event(one, _WORST, said, now), action)


def _event(one: Drive | Outputs, severity: int, said: Text, now: float) -> Event:
    return Event(now, Kind.WATCHDOG, one.name, severity, said)


def _of_drive(drive: Drive, verdict: Verdict, took_s: float) -> Text:
    summed, says = verdict.summed, _heard(drive)
    if summed is not None and summed.stops > 1:
        return Text.of("stop.deaf", stops=summed.stops, time_s=summed.time_s, says=says)
    if verdict.before is LastStop.FOLLOWED:
        return Text.of("stop.enabled_by_nobody", sent=_sent(drive), took_s=took_s, says=says)
    return Text.of("stop.ignored", sent=_sent(drive), took_s=took_s, says=says)


def _of_outputs(outputs: Outputs, verdict: Verdict, took_s: float) -> Text:
    why = outputs.stop_check.why
    if verdict.before is LastStop.FOLLOWED:
        return Text.of("stop.outputs_differ", took_s=took_s, why=why)
    return Text.of("stop.outputs_ignored", took_s=took_s, why=why)


def _reaction(one: Drive | Outputs, verdict: Verdict) -> Action | None:
    match one.table.reacts_to_ignored_stop:
        case "report":
            return None
        case "reset_node" if not verdict.again:
            return Action.RESET
        case _:
            return Action.STOP_NODE


def _cut_off(node: Node, drive: Drive, took_s: float) -> Text:
    """The bridge has stopped the drive's node, and the drive has said nothing else since."""
    why = Text.of("stop.nmt_stop_does_not_stop_it")
    if node.family.family.stopped_by == "stop_node":
        why = Text.of("stop.node_has_not_said", node=node.name)
    word, state = _status(drive)
    return Text.of("stop.may_run_on", word=word, state=state, took_s=took_s, why=why)


def _sent(drive: Drive) -> Text:
    words, silent = drive.channel.output
    return (
        Text.of("stop.nothing_is_sent") if silent else Text.of("stop.word_is_sent", word=f"{words[0]:04X}h")
    )


def _heard(drive: Drive) -> Text:
    word, state = _status(drive)
    return Text.of("stop.drive_says", word=word, state=state)


def _status(drive: Drive) -> tuple[str, Text]:
    """The drive's own status word, and the state that it tells."""
    channel = drive.channel
    return f"{channel.drive_status_word:04X}h", Text.word("drive_state", channel.state.label)


def _done(action: Action | None, node: Node, one: Drive | Outputs) -> Text:
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
