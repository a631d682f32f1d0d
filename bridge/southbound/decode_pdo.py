"""Process data of a site's drives, for those who only listen: words by name, state, scaled values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from bridge.config import NodeTable
from bridge.drive import LinearScale, StatusWords
from bridge.mapping.model import Family
from bridge.southbound.decode_sdo import Value


@dataclass(frozen=True, slots=True)
class _Scaled:
    place: int
    name: str
    unit: str
    scale: LinearScale


@dataclass(frozen=True, slots=True)
class PdoView:
    """One PDO of a configured drive, as its mapping file has it. ``states`` decodes a TPDO's first word."""

    node_id: int
    label: str
    words: tuple[str, ...]
    states: StatusWords | None
    scaled: tuple[_Scaled, ...]

    def said(self, data: bytes) -> tuple[str, tuple[tuple[str, Value | float], ...]]:
        """A sentence and the values by name. Data of any length is taken as far as it goes."""
        words = [int.from_bytes(data[at : at + 2], "little") for at in range(0, len(data) - 1, 2)]
        words = words[: len(self.words)]
        parts = [f"{name} {word:04X}h" for name, word in zip(self.words, words, strict=False)]
        values: list[tuple[str, Value | float]] = list(zip(self.words, words, strict=False))
        if self.states and words:
            state = self.states.state(words[0]).label
            parts[0] += f" {state.replace('_', ' ')}"
            values.append(("state", state))
        for scaled in self.scaled:
            if scaled.place < len(words):
                value = round(scaled.scale.from_word(words[scaled.place]), 6)
                parts[scaled.place] += f" ({scaled.name} {value:g} {scaled.unit})"
                values.append((scaled.name, value))
        if len(data) != 2 * len(self.words):
            parts.append(f"{len(data)} bytes instead of {2 * len(self.words)}")
        return ", ".join(parts), tuple(values)


def views(node: NodeTable, family: Family) -> Mapping[int, PdoView]:
    """The PDOs of a node's drives by COB-ID, those of its family that the site leaves out included."""
    found: dict[int, PdoView] = {}
    states = StatusWords(family.status_word)
    tables = {drive.slot: drive for drive in node.drive}
    for slot in family.slot:
        drive = tables.get(slot.name)
        leaf = (drive.name if drive else None) or (slot.name if len(family.slot) > 1 else "drive")
        where = f"{node.name}/{leaf}"
        scales = drive.parameters if drive else {}
        found[slot.rpdo.cob_id + node.id] = PdoView(
            node.id,
            f"RPDO{slot.rpdo.number} {where}",
            tuple(family.process.rpdo),
            None,
            _scaled(family, scales, "command", family.process.rpdo),
        )
        found[slot.tpdo.cob_id + node.id] = PdoView(
            node.id,
            f"TPDO{slot.tpdo.number} {where}",
            tuple(family.process.tpdo),
            states,
            _scaled(family, scales, "actual", family.process.tpdo),
        )
    return found


def _scaled(family: Family, scales: Mapping[str, float], group: str, words: list[str]) -> tuple[_Scaled, ...]:
    """The values whose scale the site file gives; a monitor asks no drive for the others."""
    return tuple(
        _Scaled(
            words.index(value.word),
            value.name,
            value.unit,
            LinearScale(full, value.scale.at, value.scale.limit),
        )
        for value in family.value
        if value.group == group and (full := scales.get(value.scale.full)) is not None
    )
