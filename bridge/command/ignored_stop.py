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

_WORST: Final = 1000
"""The highest severity there is (OPC UA Part 5 §6.4.2)."""
_WORDS: Final = {Action.STOP_NODE: "NMT stop", Action.RESET: "NMT reset node"}


@dataclass(frozen=True, slots=True)
class Conclusion:
    """Consequences of a verdict: ``logged`` goes to the audit log, ``event`` to people (None: it is of no
    interest), and ``action`` is taken on the node in the bridge's own name."""

    logged: str
    event: Event | None = None
    action: Action | None = None


def concluded(node: Node, one: Drive | Outputs, verdict: Verdict, now: float) -> Conclusion:
    """What follows from how the last stop of ``one`` has ended."""
    took_s = verdict.at - verdict.since
    if verdict.outcome is not LastStop.IGNORED:
        logged = f"after {took_s:.3f} s"
        if verdict.before is not LastStop.IGNORED:
            return Conclusion(logged)
        says = _heard(one) if isinstance(one, Drive) else "its outputs are as they are sent"
        return Conclusion(logged, _event(one, 300, f"follows its stop after all: {says}", now))
    if verdict.is_cut_off and isinstance(one, Drive):
        # What can be done has been done: its node has been told to stop, and takes no more words.
        message = _cut_off(node, one, took_s)
        return Conclusion(message, _event(one, _WORST, message, now))
    action = _reaction(one, verdict)
    of_one = _of_drive(one, verdict, took_s) if isinstance(one, Drive) else _of_outputs(one, verdict, took_s)
    message = f"{of_one}; {_done(action, node, one)}"
    return Conclusion(message, _event(one, _WORST, message, now), action)


def _event(one: Drive | Outputs, severity: int, message: str, now: float) -> Event:
    return Event(now, Kind.WATCHDOG, one.name, severity, message)


def _of_drive(drive: Drive, verdict: Verdict, took_s: float) -> str:
    summed = verdict.summed
    if summed is not None and summed.stops > 1:
        stops = f"{summed.stops} stops of together {summed.time_s:.2f} s"
        what = f"ignores its stop: enabled and no slower in {stops}"
    elif verdict.before is LastStop.FOLLOWED:
        what = f"is enabled although nothing that enables was sent: {_sent(drive)} for {took_s:.2f} s"
    else:
        what = f"ignores its stop: {_sent(drive)} since {took_s:.2f} s"
    return f"{what}, {_heard(drive)}"


def _of_outputs(outputs: Outputs, verdict: Verdict, took_s: float) -> str:
    why = outputs.stop_check.why
    if verdict.before is LastStop.FOLLOWED:
        return f"has other outputs than it is sent: safe values are sent for {took_s:.2f} s, {why}"
    return f"ignores its stop: safe values are sent since {took_s:.2f} s, {why}"


def _reaction(one: Drive | Outputs, verdict: Verdict) -> Action | None:
    match one.table.reacts_to_ignored_stop:
        case "report":
            return None
        case "reset_node" if not verdict.again:
            return Action.RESET
        case _:
            return Action.STOP_NODE


def _cut_off(node: Node, drive: Drive, took_s: float) -> str:
    """The bridge has stopped the drive's node, and the drive has said nothing else since."""
    why = "an NMT stop does not stop it"
    if node.family.family.stopped_by == "stop_node":
        why = f"{node.name} has not said that it is stopped"
    channel = drive.channel
    said = f"{channel.drive_status_word:04X}h, {channel.state.label.replace('_', ' ')}"
    return (
        f"may run on, and is not known to follow its stop: it said {said} before its node was taken out of "
        f"operation {took_s:.2f} s ago, and nothing since; {why}: see to it at the drive"
    )


def _sent(drive: Drive) -> str:
    words, silent = drive.channel.output
    return "nothing is sent" if silent else f"{words[0]:04X}h is sent"


def _heard(drive: Drive) -> str:
    channel = drive.channel
    return f"the drive says {channel.drive_status_word:04X}h, {channel.state.label.replace('_', ' ')}"


def _done(action: Action | None, node: Node, one: Drive | Outputs) -> str:
    if action is None:
        return "reported only (on_ignored_stop)"
    others = ", ".join(other.slot.name for other in node.drives if other is not one)
    also = f", which stops {others}, too" if others else ""
    back = "" if action is Action.RESET else "; it stays stopped until an operator starts or resets it"
    return f"{_WORDS[action]} of {node.name}{also}{back}"
