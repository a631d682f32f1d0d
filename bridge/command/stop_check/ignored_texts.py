"""Words about a stop that a drive or the outputs of a node have ignored."""

from __future__ import annotations

from bridge.command.drive_channel import DriveChannel
from bridge.command.stop_check.output_check import OutputStopCheck
from bridge.command.stop_check.state import LastStop, StopVerdict
from bridge.text import Text


def drive_says(channel: DriveChannel) -> Text:
    """Text of the drive's own status word, and of the state that it tells."""
    word, state = _status(channel)
    return Text.of("stop.drive_says", word=word, state=state)


def ignored_by_drive(channel: DriveChannel, node: str, verdict: StopVerdict, took_s: float) -> Text:
    """Text of the word that the drive was sent, and of its status after ``took_s``. If the bridge has stopped
    its node: that it may run on, and why."""
    if verdict.is_cut_off:
        return _cut_off(channel, node, took_s)
    summed, says = verdict.summed, drive_says(channel)
    if summed is not None and summed.stops > 1:
        return Text.of("stop.deaf", stops=summed.stops, time_s=summed.time_s, says=says)
    if verdict.before is LastStop.FOLLOWED:
        return Text.of("stop.enabled_by_nobody", sent=_sent(channel), took_s=took_s, says=says)
    return Text.of("stop.ignored", sent=_sent(channel), took_s=took_s, says=says)


def ignored_by_outputs(check: OutputStopCheck, verdict: StopVerdict, took_s: float) -> Text:
    """Text of how the outputs differ from what they were sent, after ``took_s``."""
    differ = verdict.before is LastStop.FOLLOWED
    return Text.of("stop.outputs_differ" if differ else "stop.outputs_ignored", took_s=took_s, why=check.why)


def _cut_off(channel: DriveChannel, node: str, took_s: float) -> Text:
    why = Text.of("stop.nmt_stop_does_not_stop_it")
    if channel.family.family.stopped_by == "stop_node":
        why = Text.of("stop.node_has_not_said", node=node)
    word, state = _status(channel)
    return Text.of("stop.may_run_on", word=word, state=state, took_s=took_s, why=why)


def _sent(channel: DriveChannel) -> Text:
    words, silent = channel.output
    if silent:
        return Text.of("stop.nothing_is_sent")
    return Text.of("stop.word_is_sent", word=f"{words[0]:04X}h")


def _status(channel: DriveChannel) -> tuple[str, Text]:
    return f"{channel.drive_status_word:04X}h", Text.word("drive_state", channel.state.label)
