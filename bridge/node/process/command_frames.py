"""Identifiers that command the drives of a node, and what a frame on one of them asks for. Sans-IO."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from bridge.command.node import Node
from bridge.drive import ControlWords
from bridge.node.boot import rpdo_plan
from bridge.node.process.output_rpdos import OutputPdos, OutputRpdo
from bridge.node.process.process_data import DrivePdos, DriveRpdo
from bridge.node.process.stop_words import StopWords
from bridge.text import Text, Words

NO_OUTPUTS: Final[Mapping[str, OutputPdos]] = MappingProxyType({})


@dataclass(frozen=True, slots=True)
class CommandFrame:
    """One RPDO that commands a drive or outputs."""

    label: Text
    words: ControlWords
    rpdo: DriveRpdo | OutputRpdo

    def said(self, data: bytes) -> Words:
        """Text of what ``data`` asks of the drive; the bytes where that is nothing."""
        raw = data.hex(" ").upper()
        word = self.rpdo.control_word(data)
        if word is None:
            return raw
        if isinstance(self.rpdo, OutputRpdo):
            return Text.of("frame.outputs_active" if word else "frame.no_output_active", data=raw)
        enables = self.words.enables(word)
        return Text.of("frame.enables" if enables else "frame.does_not_enable", data=raw, word=word)

    def enables(self, data: bytes) -> bool:
        word = self.rpdo.control_word(data)
        return word is not None and self.words.enables(word)


def commands_of(
    node: Node,
    connected: Mapping[str, DrivePdos],
    stop_words: StopWords,
    output_pdos: Mapping[str, OutputPdos] = NO_OUTPUTS,
) -> dict[int, CommandFrame]:
    """RPDOs by COB-ID: of ``connected`` drives those that the node has; of the others those under which they
    may listen; of drives that the site leaves out those of the factory; and those of outputs."""
    family = node.family
    words, count = ControlWords(family.control_word), len(family.process.rpdo)
    drives = {drive.slot.name: drive for drive in node.drives}
    found: dict[int, CommandFrame] = {}
    for slot in family.slot:
        drive = drives.get(slot.name)
        if drive is None:
            plans = [
                rpdo_plan(family, slot, pdo, pdo.cob_id + node.table.id)
                for pdo in slot.rpdo
                if not pdo.optional
            ]
            rpdos = [DriveRpdo(plan, count) for plan in plans]
        elif drive.name in connected:
            rpdos = list(connected[drive.name].rpdos)
        else:
            rpdos = [DriveRpdo(plan, count) for plan in stop_words.plans(drive).values()]
        label = Text.of("frame.rpdo_of_slot", node=node.name, slot=slot.name)
        if drive:
            label = Text.of("frame.rpdo", owner=drive.name)
        for rpdo in rpdos:
            found.setdefault(rpdo.cob_id, CommandFrame(label, words, rpdo))
    for name, pdos in output_pdos.items():
        label = Text.of("frame.rpdo", owner=name)
        found |= {rpdo.cob_id: CommandFrame(label, pdos.control_words, rpdo) for rpdo in pdos.rpdos}
    return found
