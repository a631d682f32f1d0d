"""Exposure of a bus to somebody who sends what only the bridge may send, a second master for instance."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from bridge.command.worst_case import REACTION_BOUND_MS, sync_wait_ms
from bridge.lint.checked_bus import CheckedBus, CheckedNode
from bridge.lint.interference import busy_bits, wire_of
from bridge.master.answers import SHARE, answer_bits
from bridge.text import Text, render

_LOOK_MS: Final = 10
"""Period of the search for foreign frames (``bridge/can/foreignwatch.py``)."""


@dataclass(frozen=True, slots=True)
class Exposure:
    """Exposure of one bus. ``within_ms``: from an intruding frame to the end of the answer; None where
    nothing bounds it (a load of more than 100 %). ``answers_per_s``: for the node with the most RPDOs."""

    bus: str
    on_intruder: str
    within_ms: int | None
    answers_per_s: int
    share_percent: int

    @property
    def said(self) -> Text:
        """Harm that an intruder can do."""
        if self.on_intruder == "report":
            return Text.of("exposure.reported", bus=self.bus)
        per_s, share = self.answers_per_s, self.share_percent
        if self.within_ms is None:
            return Text.of("exposure.unbounded", bus=self.bus, per_s=per_s, share=share)
        return Text.of("exposure.answered", bus=self.bus, ms=self.within_ms, per_s=per_s, share=share)

    def __str__(self) -> str:
        return render(self.said)


def exposure(bus: CheckedBus) -> Exposure:
    """Exposure of a bus by the site's files: the settings in a node may differ."""
    busy = busy_bits(bus)
    longest: float | None = 0.0
    for node in bus.nodes:
        for drive in node.drives:
            wire = wire_of(bus, drive.rpdos, busy)
            if wire.before_ms is None or longest is None:
                longest = None
                continue
            kind = drive.rpdos[0].transmission_type
            sync_ms = sync_wait_ms(bus.table, kind)
            longest = max(longest, wire.before_ms + wire.frames_ms + sync_ms)
    within_ms = None if longest is None else math.ceil(REACTION_BOUND_MS + _LOOK_MS + longest)
    bits = max((answer_bits(_identifiers(node)) for node in bus.nodes), default=answer_bits(1))
    per_s = int(SHARE * bus.table.bitrate / bits)
    return Exposure(bus.table.name, bus.table.on_intruder, within_ms, per_s, round(100 * SHARE))


def _identifiers(node: CheckedNode) -> int:
    return sum(pdo.receives and pdo.enabled for pdo in node.pdos)
