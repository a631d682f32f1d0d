"""Reaction of a device that is no drive, and of its outputs, when the bridge falls silent.

The device has to notice the silence (1016h or life guarding), to leave the state Operational then (1029h:01,
CiA 301 §7.5.2.29), and each output has to take its error value in that case (CiA 401: 6206h, 6207h and their
like for digital outputs, 6443h and 6444h for analogue ones). The mapping file names those objects.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace
from typing import Final

from bridge.canopen.dialogue import SdoRead, optional
from bridge.command.node import Node
from bridge.command.output_words import OutputPlace, OutputWords
from bridge.command.outputs import Outputs
from bridge.drive.own_judgement import OwnJudgement, OwnVerdict, judge
from bridge.mapping.entry_types import ObjectRef
from bridge.node.boot.actions import Action, BootResult, BootStep, number
from bridge.node.boot.own_supervision_setup import bring_node
from bridge.text import Said, Text

_DIGITAL: Final = range(0x6200, 0x6400)
"""Objects of digital outputs (CiA 401): one bit of error mode and error value each. Analogue ones have a
number each."""


def read_held(words: OutputWords, result: BootResult) -> Generator[Action, bytes | None, None]:
    """Read the outputs that hold their values on a stop: what is sent first must not change them."""
    for name, place in words.places.items():
        if place.safe is None:
            data = yield from optional(place.output.object.index, place.output.object.sub)
            if data is not None:
                result.held[name] = number(data) & ((1 << place.output.size) - 1)


def judge_outputs(node: Node, outputs: Outputs, result: BootResult) -> Generator[Action, bytes | None, None]:
    """Judge whether the node makes its outputs safe by itself, into ``result.bridge_stop``;
    ``own_timeout_ms`` is written first where ``enforce`` is true and the node holds something else. Raises
    BootError J where an enforced value is not taken."""
    if outputs.words.all_hold:
        result.bridge_stop = 0, Text.of("outputs.all_hold")
        return
    needed_by = "enforce" if node.table.enforce else ""
    yield BootStep(Text.of("boot_step.node_supervision"), "J", needed_by=needed_by)
    raws = yield from bring_node(node, result)
    own = judge(node.family, raws, node.bus, node.table)
    why = "" if own.verdict is OwnVerdict.STOPS else own.because
    for place in outputs.words.places.values():
        if not why and place.safe is not None:
            why = yield from read_why_not_safe(place, place.safe)
    accepted = outputs.table.accepts.runs_on or ""
    result.own[node.name] = replace(keeps_outputs(own, why) if why else own, accepted=accepted)
    stays = Text.plain(accepted) if accepted else why
    result.bridge_stop = (0, stays) if why else (own.bridge_ms, "")
    if why and not accepted:
        result.notes.append(Text.of("boot.outputs_not_safe", why=why))


def read_why_not_safe(place: OutputPlace, safe: int) -> Generator[SdoRead, bytes | None, Said]:
    """Result of ``why_not_safe`` for the values that the node holds."""
    mode = yield from _number(place.output.error_mode)
    value = yield from _number(place.output.error_value)
    return why_not_safe(place, safe, mode, value)


def why_not_safe(place: OutputPlace, safe: int, mode: int | None, value: int | None) -> Said:
    """Reason why the output does not take its safe value when the node leaves Operational; empty where it
    does. ``mode`` and ``value`` are the contents of error mode and error value, None if unknown."""
    output = place.output
    if output.error_mode is None or output.error_value is None:
        return Text.of("outputs.no_error_mode", output=output.name)
    if mode is None or value is None:
        missing = output.error_mode if mode is None else output.error_value
        return Text.of("outputs.unreadable", output=output.name, object=str(missing))
    bits = (1 << output.size) - 1
    if output.object.index in _DIGITAL:
        if keeps := ~mode & bits:
            count, by = keeps.bit_count(), str(output.error_mode)
            return Text.of("outputs.keeps_bits", output=output.name, count=count, object=by, mode=mode)
    elif not mode & 0xFF:
        return Text.of("outputs.keeps_value", output=output.name, object=str(output.error_mode))
    if value & bits != safe:
        becomes, by = value & bits, str(output.error_value)
        return Text.of("outputs.becomes", output=output.name, value=becomes, object=by, safe=safe)
    return ""


def keeps_outputs(own: OwnJudgement, why: Said, *, is_known: bool = True) -> OwnJudgement:
    """``own`` of a node that notices a silent bridge, but does not make all of its outputs safe."""
    verdict = OwnVerdict.RUNS_ON if is_known else OwnVerdict.UNKNOWN
    watches = [
        replace(watch, verdict=verdict, because=why) if watch.verdict is OwnVerdict.STOPS else watch
        for watch in own.watches
    ]
    return replace(own, watches=tuple(watches))


def _number(ref: ObjectRef | None) -> Generator[SdoRead, bytes | None, int | None]:
    if ref is None:
        return None
    data = yield from optional(ref.index, ref.sub)
    return None if data is None else number(data)
