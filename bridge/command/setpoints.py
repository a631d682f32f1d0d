"""What is special about the setpoints of one drive: handed over with a handshake, or following a position."""

from __future__ import annotations

from bridge.drive import Handshake, ValueCodec
from bridge.mapping.model import Family, Slot


def handshake_of(family: Family, slot: Slot) -> Handshake | None:
    """The handshake by which this drive takes over positions, or None where it has none."""
    model = family.control_word.handshake
    if model is None:
        return None
    for value in family.values_of(slot):
        if (value.group, value.name) == ("command", model.value):
            return Handshake(model, ValueCodec(value, family.process.rpdo[1:]).places)
    return None


def followers_of(family: Family, slot: Slot) -> list[tuple[int, int]]:
    """Setpoints that follow actual words: the place of each setpoint, and that of its actual word."""
    values = {value.leaf: value for value in family.values_of(slot)}
    return [
        (family.process.rpdo.index(word) - 1, family.process.tpdo.index(source))
        for value in values.values()
        if value.follows is not None and (followed := values.get(f"actual/{value.follows}"))
        for word, source in zip(value.word_names, followed.word_names, strict=True)
    ]
