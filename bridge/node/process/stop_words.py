"""Stop words for the drives of a node, on every identifier on which it may listen.

A restarted bridge does not know what the node holds. So the factory's identifiers, the site file's, and those
that the node has named in a boot-up get a frame each, packed by the best mapping known.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Final

from bridge.canopen import cobid
from bridge.canopen.frame import Frame
from bridge.canopen.pdo import PdoEntry
from bridge.command import Drive
from bridge.command.node import Node
from bridge.config.download import Download
from bridge.config.model import pdo_table
from bridge.mapping.model import Pdo
from bridge.node.boot import MOST_ENTRIES, BootMemory, PdoPlan, rpdo_plan
from bridge.node.process.process_data import DrivePdos, DriveRpdo

_RPDO: Final = 0x1400
_TPDO: Final = 0x1800
_MAPPING: Final = 0x1600
_MOST_PDOS: Final = 512

IsForeign = Callable[[int], bool]


class StopWords:
    """Stop words of one node. ``downloads`` are what the site's files configure; ``memory`` has what the node
    has said."""

    def __init__(self, node: Node, downloads: Sequence[Download], memory: BootMemory) -> None:
        self._node = node
        self._memory = memory
        self._known = {drive.name: list(_known(node, drive, downloads)) for drive in node.drives}
        self.given_ids = frozenset(_given_ids(node, downloads))
        """Identifiers that the site's files give to PDOs of this node: no other node's stop goes there."""

    def plans(self, drive: Drive) -> dict[int, PdoPlan]:
        """RPDOs under which this drive may listen, by COB-ID."""
        # Of one identifier what the node itself has said of it counts, and that comes last.
        plans = [*self._known[drive.name], *self._memory.rpdos_of(drive.name)]
        return {plan.cob_id: plan for plan in plans}

    def frames(self, connected: Mapping[str, DrivePdos], is_foreign: IsForeign) -> list[Frame]:
        """Stop for every drive, without setpoints: on its PDOs the words that stop it at present, which may
        be a ramp; where they are not known, a stopped word. Identifiers of other nodes (``is_foreign``) are
        left alone."""
        frames: list[Frame] = []
        for drive in self._node.drives:
            channel = drive.channel
            process = drive.family.process
            count = len(process.rpdo)
            words: Sequence[int] = (channel.words.stopped, *process.resting)
            pdos = connected.get(drive.name)
            if pdos and not channel.output.silent and not channel.words.enables(channel.output.words[0]):
                words = channel.output.words
            # Nothing is sent into objects that nobody knows.
            plans = [plan for plan in self.plans(drive).values() if plan.words]
            packed = {plan.cob_id: DriveRpdo(plan, count).frame(words) for plan in plans}
            for frame in pdos.frames_with(words) if pdos else []:
                packed.pop(frame.can_id, None)
                packed[frame.can_id] = frame
            frames += [frame for can_id, frame in packed.items() if not is_foreign(can_id)]
        return frames


def _known(node: Node, drive: Drive, downloads: Sequence[Download]) -> Iterator[PdoPlan]:
    """RPDOs of a drive by the mapping file, without those that are off at the factory, then by the
    configuration and the site file."""
    for pdo in drive.slot.rpdo:
        factory_id = pdo.cob_id + node.table.id
        if not pdo.optional:
            yield rpdo_plan(drive.family, drive.slot, pdo, factory_id)
        configured = _configured(pdo, downloads)
        if configured is not None:
            yield rpdo_plan(drive.family, drive.slot, pdo, *configured)
        asked = pdo_table(drive.table.rpdo, pdo.number, drive.slot.rpdo[0].number)
        if asked is not None and asked.enable:
            entries = asked.mapping
            yield rpdo_plan(drive.family, drive.slot, pdo, asked.cob_id or factory_id, entries)


def _configured(pdo: Pdo, downloads: Sequence[Download]) -> tuple[int, list[PdoEntry]] | None:
    """COB-ID and mapping that are downloaded for this PDO, without entries where no mapping is; None where it
    is off."""
    held = {(one.index, one.sub): int.from_bytes(one.data, "little") for one in downloads}
    cob_id = held.get((_RPDO + pdo.number - 1, 1), cobid.PDO_DISABLED)
    if cob_id & (cobid.PDO_DISABLED | cobid.PDO_EXTENDED):
        return None
    mapping = _MAPPING + pdo.number - 1
    count = min(MOST_ENTRIES, held.get((mapping, 0), 0))
    words = [held.get((mapping, sub), 0) for sub in range(1, count + 1)]
    return cob_id & cobid.COB_ID_MASK, [PdoEntry.from_object(word) for word in words if word]


def _given_ids(node: Node, downloads: Sequence[Download]) -> Iterator[int]:
    """Identifiers that the site file and the configuration name for PDOs of this node."""
    for drive in node.drives:
        for table in (*drive.table.rpdo, *drive.table.tpdo):
            if table.cob_id is not None:
                yield table.cob_id
    for one in downloads:
        if one.sub == 1 and any(base <= one.index < base + _MOST_PDOS for base in (_RPDO, _TPDO)):
            yield int.from_bytes(one.data, "little") & cobid.COB_ID_MASK
