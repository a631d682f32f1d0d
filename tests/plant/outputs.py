"""A node with outputs beside the drives, and its owner, who is there for a while: what somebody has stopped
stays safe until the owner sends the safe values (docs: dead-man-chain.md, "Outputs")."""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING, Final

from bridge.command import Action, Identity, Outcome, Request, Source, command_of
from tests.plant.clients import Line, writes
from tests.plant.oracle import REACTION_S, Oracle
from tests.plant.plan import Step
from tests.proof.block import BLOCK
from tests.proof.settings import PLANT

if TYPE_CHECKING:
    from tests.plant.plant import Plant

_NMT: Final = 0x000
_START: Final = 0x01
_ACKNOWLEDGE, _OUTPUTS = 11, 32
"""Holding registers (docs/reference/modbus.md)."""
_HOST: Final = "127.0.0.40"
_DELAY_S: Final = 0.002
_BEGINS_S: Final = 1.5
_HOLDS_S: Final = _BEGINS_S + PLANT.fieldbus_timeout_ms / 1000 + 0.5
_ENDS_S: Final = 3.0
"""So long what was stopped is looked at."""


class Outputs:
    """Judge of what the outputs get. What is wrong goes to the oracle's violations."""

    def __init__(self, oracle: Oracle) -> None:
        self._oracle = oracle
        self._safe_from = inf
        self._disturbed_at = -inf
        self.sent = b""
        self._sent_at = -inf
        """When the bridge last sent them something, with their node where it was then."""

    def disturbed(self, at: float) -> None:
        """The bridge fails, or is back: then an acknowledge is enough for active values."""
        self._disturbed_at, self._safe_from = at, inf

    def frame(self, at: float, can_id: int, data: bytes) -> None:
        """A frame of the bridge."""
        if can_id == _NMT and data[0] != _START and data[1] in (0, BLOCK.node_id):
            self._sent_at = -inf
        if can_id != BLOCK.rpdo:
            return
        self._sent_at = at
        self.sent = data[: len(BLOCK.safe)]
        if at > self._safe_from and self.sent != BLOCK.safe:
            self._oracle.wrong(at, f"outputs that somebody has stopped get {self.sent.hex()}")

    def stopped(self, at: float, came: float, outcome: Outcome) -> None:
        """Somebody's stop was answered. It is forwarded where words reach the outputs: not while their node
        is stopped or booted, but then they are safe from their next word on all the same."""
        if self._disturbed_at >= came - 1.0:
            return
        self._oracle.looks += 1
        is_sent = outcome.forwarded or self._sent_at < came - REACTION_S
        if not (outcome.ok and is_sent):
            said = f"{outcome.code}{'' if outcome.forwarded else ', not forwarded'}"
            self._oracle.wrong(at, f"a stop of outputs that are active is answered {said}")
        self._safe_from = at + REACTION_S

    def free(self) -> None:
        """Their owner may have sent the safe values."""
        self._safe_from = inf


def stop_outputs(plant: Plant, step: Step) -> None:
    """Outputs get active values; their owner is silent, so that some of them hold, or acknowledges in each
    cycle (``how``); and somebody stops them."""
    if plant.has_outputs:
        return
    plant.has_outputs = True
    world, judge = plant.world, plant.outputs
    line = Line(world, plant.bridge, _HOST, lambda data: None)
    line.connect()
    began, is_silent = world.now, step.how == "silent"
    stops_at = began + (_HOLDS_S if is_silent else _BEGINS_S + 0.5)

    def cycle() -> None:
        age_s = world.now - began
        if world.now > stops_at + _ENDS_S:
            return
        world.after(PLANT.owner_period_s, cycle)
        if is_silent and age_s > _BEGINS_S:
            return
        if world.now > stops_at or age_s < 0.4:
            line.ask(BLOCK.unit, writes(_ACKNOWLEDGE, 1))
        line.ask(BLOCK.unit, writes(_OUTPUTS, *(BLOCK.safe if age_s < 0.8 else BLOCK.active)))

    def stop() -> None:
        if judge.sent != (BLOCK.held if is_silent else BLOCK.active):
            return
        came = world.now
        who = Identity(Source.OPCUA, "operator", connection="session 97")
        request = Request(who, BLOCK.path, command_of(Action.STOP))
        plant.bridge.ask(
            request, _DELAY_S, lambda: None, lambda outcome: judge.stopped(world.now, came, outcome)
        )

    def leave() -> None:
        judge.free()
        line.ask(BLOCK.unit, writes(_ACKNOWLEDGE, 1))
        line.ask(BLOCK.unit, writes(_OUTPUTS, *BLOCK.safe))
        line.leave()
        plant.has_outputs = False

    world.after(0.3, cycle)
    world.at(stops_at, stop)
    world.at(stops_at + _ENDS_S, leave)
