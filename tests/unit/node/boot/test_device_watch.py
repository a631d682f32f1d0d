"""Outputs when the bridge falls silent (CiA 401): whether the node makes each of them safe, or why not."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.command.node import Node
from bridge.command.output_words import OutputPlace, OutputWords
from bridge.command.outputs import Outputs
from bridge.config import SafeValue
from bridge.drive.own_judgement import DriveWatch, OwnJudgement, OwnVerdict
from bridge.mapping.device_signals import Output
from bridge.node.boot.actions import BootResult
from bridge.node.boot.device_watch import (
    judge_outputs,
    keeps_outputs,
    read_held,
    read_why_not_safe,
    why_not_safe,
)
from bridge.text import Text, render
from tests.support.answering import Answering
from tests.support.devices import IO_BLOCK, OUTPUTS
from tests.support.nodes import device_plant


def place(index: str, kind: str, on_expiry: SafeValue = 0, *, has_errors: bool = True) -> OutputPlace:
    keys: dict[str, object] = {"name": "valves", "object": index, "data_type": kind, "on_expiry": on_expiry}
    if has_errors:
        keys |= {"error_mode": "6206:01", "error_value": "6207:01"}
    return OutputWords("block", (Output.model_validate(keys),), {}).places["valves"]


DIGITAL, ANALOGUE = place("6200:01", "uint8"), place("6411:01", "int16", 5)


@pytest.mark.parametrize(
    ("one", "safe", "mode", "value", "why"),
    [
        (DIGITAL, 0, 0xFF, 0x00, ""),
        (DIGITAL, 0, 0xFC, 0x00, "valves keeps 2 of its bits: 6206:01 is FCh"),
        (DIGITAL, 0, 0x00, 0x00, "valves keeps 8 of its bits: 6206:01 is 0h"),
        (DIGITAL, 0, 0xFF, 0x01, "valves becomes 1h by 6207:01, not 0h"),
        (ANALOGUE, 5, 1, 5, ""),
        (ANALOGUE, 5, 0, 5, "valves keeps its value: 6206:01 is 0"),
        (ANALOGUE, 5, 0x100, 5, "valves keeps its value: 6206:01 is 0"),
        (ANALOGUE, 5, 1, 0x1_0005, ""),
        (ANALOGUE, 5, 1, 6, "valves becomes 6h by 6207:01, not 5h"),
        (DIGITAL, 0, None, 0, "what valves does then is not known: 6206:01 cannot be read"),
        (DIGITAL, 0, 0xFF, None, "what valves does then is not known: 6207:01 cannot be read"),
    ],
)
def test_an_output_is_safe_where_mode_and_value_say_so(
    one: OutputPlace, safe: int, mode: int | None, value: int | None, why: str
) -> None:
    """CiA 401: an error mode of 1 takes the error value; digital ones have a bit each."""
    assert render(why_not_safe(one, safe, mode, value)) == why


def test_what_the_mapping_does_not_name_is_not_known() -> None:
    one = place("6200:01", "uint8", has_errors=False)
    why = why_not_safe(one, 0, 0xFF, 0)
    assert (
        render(why) == "what valves does then is not known: the mapping names no error_mode and error_value"
    )
    node = Answering()
    assert node.run(read_why_not_safe(one, 0)) == why
    assert node.reads == []


def test_it_is_judged_by_what_the_node_holds() -> None:
    node = Answering({(0x6206, 1): b"\xff", (0x6207, 1): b"\0"})
    assert node.run(read_why_not_safe(DIGITAL, 0)) == ""
    del node.objects[0x6207, 1]
    assert render(node.run(read_why_not_safe(DIGITAL, 0))).endswith("6207:01 cannot be read")


def test_a_node_that_notices_and_keeps_its_outputs_runs_on() -> None:
    stops = DriveWatch("heartbeat", "heartbeat", "1016:01", 300.0, "stops", OwnVerdict.STOPS, silent_ms=100)
    link = DriveWatch("link", "link", "x", None, "", None)
    own = OwnJudgement((stops, link))
    assert own.verdict is OwnVerdict.STOPS
    kept = keeps_outputs(own, "valves keeps its value")
    assert (kept.verdict, kept.reason) == (OwnVerdict.RUNS_ON, "valves keeps its value")
    assert kept.watches[1] == link
    assert keeps_outputs(own, "?", is_known=False).verdict is OwnVerdict.UNKNOWN


def test_what_is_to_hold_is_read_so_that_the_first_frame_changes_nothing() -> None:
    holds = Output.model_validate(
        {"name": "lamp", "object": "6411:02", "data_type": "int16", "on_expiry": "hold"}
    )
    safe = Output.model_validate({"name": "fan", "object": "6411:03", "data_type": "int16"})
    words, result = OutputWords("block", (holds, safe), {}), BootResult()
    Answering({(0x6411, 2): b"\xfe\xff\xff\xff", (0x6411, 3): b"\7\0"}).run(read_held(words, result))
    assert result.held == {"lamp": 0xFFFE}
    nothing = BootResult()
    Answering().run(read_held(words, nothing))
    assert nothing.held == {}


def block(folder: Path, outputs: str = "") -> tuple[Node, Outputs]:
    more = OUTPUTS.replace("[modbus]", f"{outputs}\n[modbus]")
    node = device_plant(folder, IO_BLOCK, more).nodes["shaft"]
    (device,) = node.devices
    (commanded,) = device.commanded
    return node, commanded


SAFE = {
    (0x1016, 1): (127 << 16 | 300).to_bytes(4, "little"),
    (0x1029, 1): b"\0",
    (0x6206, 1): b"\xff",
    (0x6207, 1): b"\0",
    (0x6443, 1): b"\1",
    (0x6444, 1): (50).to_bytes(4, "little"),
}


def judged(folder: Path, objects: dict[tuple[int, int], bytes], outputs: str = "") -> BootResult:
    node, commanded = block(folder, outputs)
    result = BootResult()
    Answering(objects).run(judge_outputs(node, commanded, result))
    return result


def test_a_node_that_makes_all_of_them_safe_has_its_time(tmp_path: Path) -> None:
    result = judged(tmp_path, SAFE)
    assert result.own["shaft"].verdict is OwnVerdict.STOPS
    assert result.bridge_stop == (result.own["shaft"].bridge_ms, "")
    assert result.bridge_stop[0] > 300
    assert result.notes == []


def test_one_output_that_is_kept_is_enough_to_run_on(tmp_path: Path) -> None:
    result = judged(tmp_path, {**SAFE, (0x6206, 1): b"\xfe"})
    why = "valves keeps 1 of its bits: 6206:01 is FEh"
    assert result.own["shaft"].verdict is OwnVerdict.RUNS_ON
    assert (result.bridge_stop[0], render(result.bridge_stop[1])) == (0, why)
    assert [*map(render, result.notes)] == [
        f"outputs are not safe by themselves when the bridge falls silent: {why}"
    ]


def test_what_the_site_accepts_is_no_note(tmp_path: Path) -> None:
    result = judged(tmp_path, {**SAFE, (0x6206, 1): b"\xfe"}, 'accepts = { runs_on = "only a lamp is kept" }')
    assert result.bridge_stop == (0, Text.plain("only a lamp is kept"))
    assert result.notes == []
    assert result.own["shaft"].accepted == "only a lamp is kept"


def test_where_all_hold_nothing_is_read(tmp_path: Path) -> None:
    node, commanded = block(tmp_path, 'on_expiry = { valves = "hold", speed = "hold" }')
    asked, result = Answering(SAFE), BootResult()
    asked.run(judge_outputs(node, commanded, result))
    assert asked.reads == []
    assert result.bridge_stop == (0, Text.of("outputs.all_hold"))
