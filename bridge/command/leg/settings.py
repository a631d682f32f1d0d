"""Settings of a leg, fixed while it runs: its family's words and the site file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from bridge.command.messages.life_sign import LifeSign
from bridge.command.messages.telegram import Telegram
from bridge.config import IGNORE_ALL_S, DriveTable, ReactionRule
from bridge.drive import ControlWords, ValueCodec
from bridge.image import Value
from bridge.mapping.model import Family, Slot

Decode = Callable[[Mapping[str, Value], tuple[int, ...], int, bool], Telegram]
"""Values that are written, over these setpoints, with this control word where none is written, and whether
the drive is heard. Raises ``Refusal``."""


@dataclass(frozen=True, slots=True)
class HandshakeSettings:
    """``value`` is handed over by the bit ``mask``; ``places`` are those of its words among the setpoints."""

    value: str
    mask: int
    acknowledged: int
    """The drive's answer, in its status word."""
    places: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class LegSettings:
    words: ControlWords
    decode: Decode
    setpoints: int
    control: str
    reaction: ReactionRule
    timeout_ms: int
    then_silence_s: float
    ignores_errors: bool
    """telegram_downtime_s = -0.1: whatever is wrong is reported only."""
    stop_by_anyone: bool
    timeout_writable: bool
    timeout_range_ms: tuple[int, int]
    follows: tuple[tuple[int, int], ...]
    """Places of setpoints that are the drive's actual words, and those of these words, as long as nothing is
    commanded: enabling moves nothing then."""
    handshake: HandshakeSettings | None
    resting: tuple[int, ...] = ()
    """The setpoints while nobody commands them; left out: all 0."""
    life: LifeSign | None = None
    """Tokens that the owner's program has to bring back."""
    acknowledge_resumes: bool = False
    """An acknowledge stands for a word that does not enable, unless somebody has stopped it by a command:
    that asks for such a word of the owner's own."""


def leg_settings(
    family: Family, table: DriveTable, decode: Decode, life: LifeSign | None = None
) -> LegSettings:
    """Settings of a drive of this family, as the site file has it. ``life``: its tokens where it asks for a
    life sign, random ones by default."""
    slot = family.slot_named(table.slot)
    low_ms, high_ms = table.timeout_range_ms
    return LegSettings(
        words=ControlWords(family.control_word),
        decode=decode,
        setpoints=len(family.process.rpdo) - 1,
        control=table.control,
        reaction=table.reaction,
        timeout_ms=table.fieldbus_timeout_ms or 0,
        then_silence_s=table.then_silence_ms / 1000,
        ignores_errors=table.telegram_downtime_s == IGNORE_ALL_S,
        stop_by_anyone=table.stop_by_anyone,
        timeout_writable=table.fieldbus_timeout_writable,
        timeout_range_ms=(low_ms, high_ms),
        follows=_followers(family, slot),
        handshake=_handshake(family, slot),
        resting=family.process.resting,
        life=(life or LifeSign.at_random()) if table.life_sign else None,
    )


def _handshake(family: Family, slot: Slot) -> HandshakeSettings | None:
    """The handshake by which this drive takes over positions, None where it has no handshake."""
    model = family.control_word.handshake
    if model is None:
        return None
    for value in family.values_of(slot):
        if (value.group, value.name) == ("command", model.value):
            places = tuple(ValueCodec(value, family.process.rpdo[1:]).places)
            return HandshakeSettings(model.value, 1 << model.bit, 1 << model.acknowledge_bit, places)
    return None


def _followers(family: Family, slot: Slot) -> tuple[tuple[int, int], ...]:
    """Setpoints that follow actual words: the place of each setpoint, and that of its actual word."""
    values = {value.leaf: value for value in family.values_of(slot)}
    return tuple(
        (family.process.rpdo.index(word) - 1, family.process.tpdo.index(source))
        for value in values.values()
        if value.follows is not None and (followed := values.get(f"actual/{value.follows}"))
        for word, source in zip(value.word_names, followed.word_names, strict=True)
    )
