"""Outputs under every sequence of events: the answers are true, and a stop by somebody stays one. And what is
shown of them at once."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from bridge.catalogue.codes import WatchdogState
from bridge.command import Action, Command, Do, Outcome, Request, Write
from bridge.command.drive_link import NodeState
from bridge.command.leg.draft import Draft
from bridge.command.output_words import OutputWords
from bridge.command.outputs import OutputChannel
from bridge.command.stop_check.output_check import OutputReadback
from bridge.command.stop_check.state import LastStop
from bridge.image import Quality, Value
from bridge.mapping.entry_types import ObjectRef
from bridge.text import Said, Text
from tests.support.devices import IO_BLOCK, OUTPUTS
from tests.support.leg_outputs import OutputSpace
from tests.support.node_states import hand_over, node_goes, run_timers
from tests.support.nodes import device_plant
from tests.support.rig import PLC

BLOCKS = [(0, 0), (0, "hold"), ("hold", "hold"), (5, "hold")]
"""What two outputs of a block get when nobody commands them."""


@pytest.mark.landing(2)
@pytest.mark.parametrize("on_expiry", BLOCKS)
def test_whatever_happens_to_outputs(on_expiry: Any) -> None:
    space = OutputSpace(on_expiry)
    assert space.explore() > 100
    assert space.steps > 3000


def _forgets(turn: Draft, word: int, *, is_asked: bool = False) -> None:
    turn.word, turn.is_ours, turn.is_asked = word, True, is_asked
    turn.drop_setpoints()


FAULTS: dict[str, tuple[object, str, object]] = {
    "what holds outlasts a stop": (OutputChannel, "_on_let_go", lambda channel: None),
    "an acknowledge takes a stop back": (Draft, "stop", _forgets),
    "outputs keep what they got": (OutputWords, "safe", lambda words, held: tuple(held)),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_found(fault: str, monkeypatch: pytest.MonkeyPatch) -> None:
    where, name, wrong = FAULTS[fault]
    space = OutputSpace((5, "hold"))
    monkeypatch.setattr(where, name, wrong)
    with pytest.raises(AssertionError, match="\nafter "):
        space.explore()


class Block:
    """The outputs of an I/O block in operation, on a virtual clock and no bus: valves that are safe at 0, a
    speed and a lamp."""

    def __init__(self, folder: Path, site: str = OUTPUTS) -> None:
        self.plant = device_plant(folder, IO_BLOCK, site)
        self.node = self.plant.nodes["shaft"]
        (device,) = self.node.devices
        (self.outputs,) = device.commanded
        self.now = 10.0
        node_goes(self.plant, self.node, NodeState.OPERATIONAL, self.now)

    def boots(self, unserved: dict[ObjectRef, Text], bridge_stop: tuple[int, Said] = (0, "")) -> None:
        self.outputs.on_pdos(255, unserved, {}, bridge_stop, self.now)

    def ask(self, command: Command) -> Outcome:
        outcomes: list[Outcome] = []
        self.plant.submit(Request(PLC, "shaft", command), self.now, outcomes.append)
        return outcomes[0]

    def go(self) -> None:
        for valves in (0, 1):
            assert self.ask(Write({"valves": valves})).ok

    def stop(self) -> None:
        """By somebody's command, and the words are on the bus."""
        assert self.ask(Do(Action.STOP)).ok
        hand_over(self.plant, self.outputs, self.now)

    def answers(self, raw: int) -> str | None:
        """An answer to the next question of what an output holds; the output's name."""
        question = self.outputs.stop_check.question(self.now)
        if question is None:
            return None
        self.outputs.on_answer(question, OutputReadback(raw), self.now)
        return question.output.name

    def shown(self, leaf: str) -> tuple[Value, Quality, str]:
        reading = self.plant.image.read(f"shaft/{leaf}")
        return reading.value, reading.quality, reading.reason

    def value(self, leaf: str) -> Value:
        return self.shown(leaf)[0]


@pytest.fixture
def block(tmp_path: Path) -> Block:
    return Block(tmp_path)


def test_without_a_time_out_outputs_keep_what_a_silent_owner_wrote(tmp_path: Path) -> None:
    block = Block(tmp_path, OUTPUTS.replace("fieldbus_timeout_ms = 200", "fieldbus_timeout_ms = 0"))
    assert block.value("supervision/fieldbus_timeout_ms") == 0
    block.go()
    block.now += 3600.0
    run_timers(block.plant, block.now)
    assert block.value("output/valves") == 1
    assert block.value("supervision/watchdog_state") == WatchdogState.OFF


def test_with_one_they_are_safe_when_it_is_over(block: Block) -> None:
    block.go()
    block.now += 0.25
    run_timers(block.plant, block.now)
    assert block.value("output/valves") == 0
    assert block.value("supervision/watchdog_state") == WatchdogState.TRIPPED


def test_of_an_output_that_no_rpdo_carries_nobody_asks_whether_it_has_stopped(block: Block) -> None:
    """Its value is none of the stop's, and is shown as such."""
    why = Text.plain("no RPDO carries 6411:01")
    block.boots({ObjectRef(0x6411, 1): why})
    assert block.shown("output/speed")[1:] == (Quality.CONFIG_ERROR, "no RPDO carries 6411:01")
    block.go()
    block.stop()
    block.now += 1.0
    assert [block.answers(0), block.answers(0), block.answers(0)] == ["valves", "lamp", None]
    assert block.value("supervision/last_stop") == LastStop.FOLLOWED


def test_what_an_answer_says_of_a_stop_is_shown_with_it(block: Block) -> None:
    block.boots({})
    block.go()
    block.stop()
    block.now += 1.0
    assert block.answers(1) == "valves"
    assert block.shown("supervision/follows") == (False, Quality.GOOD, "")
    assert block.shown("supervision/last_stop") == (
        LastStop.IGNORED,
        Quality.GOOD,
        "6200h:01 (valves) holds 01h instead of 00h",
    )


@pytest.mark.parametrize(
    ("bridge_stop", "shown"),
    [
        ((350, ""), (350, Quality.GOOD, "")),
        ((0, "1016h:01 is 0"), (0, Quality.CONFIG_ERROR, "1016h:01 is 0")),
    ],
)
def test_the_time_to_safe_outputs_after_the_bridges_hang_is_good_where_there_is_one(
    block: Block, bridge_stop: tuple[int, Said], shown: tuple[int, Quality, str]
) -> None:
    block.boots({}, bridge_stop)
    assert block.shown("supervision/worst_case_bridge_ms") == shown
    block.outputs.on_own_supervision_changed(Text.plain("1016h:01 has been written"), block.now)
    after = (0, Quality.CONFIG_ERROR, "1016h:01 has been written")
    assert block.shown("supervision/worst_case_bridge_ms") == after
