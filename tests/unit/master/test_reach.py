"""Why the words of a drive or of outputs do not reach the bus, case by case, and when that is told."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, cast

import pytest

from bridge.canopen.nmt import NmtCommand
from bridge.command.drive_link import NodeState
from bridge.master.reach import Reach
from bridge.text import render


@dataclass
class Bus:
    """One node with a drive called ``fu1``; each reason that is told."""

    acts: bool = True
    told: list[str] = field(default_factory=list[str])

    def reach(self, *, awaited: bool = False, **node: object) -> Reach:
        one = SimpleNamespace(name="fu1")
        one.channel = SimpleNamespace(on_sending=lambda why, now: self.told.append(render(why)))
        facts: dict[str, object] = {
            "node": SimpleNamespace(commanded=[one]),
            "state": NodeState.OPERATIONAL,
            "is_operational": True,
            "sends_process_data": True,
            "is_held": False,
            "told": None,
            "wire": self.wire("fu1"),
        }
        core = SimpleNamespace(**(facts | node))
        charge = SimpleNamespace(acts=lambda: self.acts, why_not="another bridge is in charge")
        farewell = SimpleNamespace(awaiting=(core,) if awaited else ())
        return Reach([cast(Any, core)], cast(Any, charge), cast(Any, farewell))

    @staticmethod
    def wire(*carried: str) -> SimpleNamespace:
        return SimpleNamespace(
            carries=lambda one: one.name in carried,
            why_left_out=lambda one: f"{one.name} has no RPDO",
        )

    def why(self, **node: Any) -> str:
        self.reach(**node).on_bus(1.0)
        return self.told[-1]


def test_words_reach_a_node_that_gets_them() -> None:
    assert Bus().why() == ""


def test_it_is_told_when_something_has_changed_and_not_else() -> None:
    bus = Bus()
    reach = bus.reach()
    for _ in range(3):
        reach.on_bus(1.0)
    assert bus.told == [""]
    reach.on_bus(2.0, is_up=False)
    reach.on_bus(2.0)
    assert bus.told == ["", "the bus is down"]
    reach.on_bus(3.0, is_up=True)
    bus.acts = False
    reach.on_bus(4.0)
    assert bus.told[2:] == ["", "another bridge is in charge"]


@pytest.mark.parametrize(("awaited", "why"), [(True, ""), (False, "another bridge is in charge")])
def test_a_bridge_that_is_not_in_charge_says_farewell_alone(awaited: bool, why: str) -> None:
    assert Bus(acts=False).why(awaited=awaited) == why


@pytest.mark.parametrize(
    ("is_held", "told", "said"),
    [
        (False, None, "no words are sent to it"),
        (False, NmtCommand.STOP, "no words are sent to it"),
        (True, None, "no words are sent to it"),
        (True, NmtCommand.STOP, "NMT stop was sent to it, and no words are"),
    ],
)
def test_of_a_node_that_gets_no_words_its_state_and_the_command_are_said(
    is_held: bool, told: NmtCommand | None, said: str
) -> None:
    state = NodeState.STOPPED
    why = Bus().why(sends_process_data=False, is_held=is_held, told=told, state=state, is_operational=False)
    assert why == f"the drive's node is {state.value}; {said}"


@pytest.mark.parametrize("is_operational", [True, False])
def test_who_is_left_out_of_a_node_that_gets_words_is_told_why(is_operational: bool) -> None:
    state = NodeState.OPERATIONAL if is_operational else NodeState.BOOTING
    facts = {"is_operational": is_operational, "state": state, "wire": Bus.wire()}
    not_booted = f"the drive's node is {state.value}; no words are sent to it"
    assert Bus().why(**facts) == ("fu1 has no RPDO" if is_operational else not_booted)
