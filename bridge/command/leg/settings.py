"""What does not change while a drive is commanded: its family's words and the site file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from bridge.command.telegram import Telegram
from bridge.config import Reaction
from bridge.drive import ControlWords, ValueCodec
from bridge.image import Value
from bridge.mapping.model import Family, Slot

Decode = Callable[[Mapping[str, Value], tuple[int, ...], int], Telegram]
"""Values that are written, over these setpoints, with this control word where none is written. Raises
``Refusal``."""


@dataclass(frozen=True, slots=True)
class HandshakeSettings:
    """``value`` is handed over by the bit ``mask``; ``places`` are those of its words among the setpoints."""

    value: str
    mask: int
    acknowledged: int
    """The drive's answer, in its status word."""
    places: tuple[int, ...]


def handshake_of(family: Family, slot: Slot) -> HandshakeSettings | None:
    """The handshake by which this drive takes over positions, or None where it has none."""
    model = family.control_word.handshake
    if model is None:
        return None
    for value in family.values_of(slot):
        if (value.group, value.name) == ("command", model.value):
            places = tuple(ValueCodec(value, family.process.rpdo[1:]).places)
            return HandshakeSettings(model.value, 1 << model.bit, 1 << model.acknowledge_bit, places)
    return None


@dataclass(frozen=True, slots=True)
class LegSettings:
    words: ControlWords
    decode: Decode
    setpoints: int
    control: str
    reaction: Reaction
    timeout_ms: int
    then_silence_s: float = 0.0
    ignores_errors: bool = False
    """telegram_downtime_s = -0.1: whatever is wrong is reported only."""
    stop_by_anyone: bool = True
    timeout_writable: bool = False
    timeout_range_ms: tuple[int, int] = (0, 0)
    follows: tuple[tuple[int, int], ...] = ()
    """Places of setpoints that are the drive's actual words, and those of these words, as long as nothing is
    commanded: enabling moves nothing then."""
    handshake: HandshakeSettings | None = None
