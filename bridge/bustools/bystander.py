"""Checks of a drive, or of a node that is none, before it is written to without its bridge. Sans-IO."""

from __future__ import annotations

from collections.abc import Generator, Iterable

from bridge.bustools.drop_test import ForeignMaster
from bridge.canopen import cobid
from bridge.canopen.frame import Frame
from bridge.command.output_words import OutputPlace, OutputWords
from bridge.config import NodeTable
from bridge.drive import MOVING, StatusWords
from bridge.mapping.model import Family, Slot
from bridge.parameter import Names, ParameterEntry, ParameterError, Transfer, TransferFailed, Why
from bridge.parameter.protection import Gate
from bridge.parameter.write_effect import WriteVerdict, judge
from bridge.text import Text

_WORD_BYTES = 2


class Bystander(ForeignMaster):
    """Listener for another master of this bus; ``status`` is the status word of a TPDO that is heard. A node
    that is no drive has no slot, and no status word."""

    def __init__(
        self, own_id: int, node: NodeTable, family: Family, slot: Slot | None, now: float, listen_s: float
    ):
        super().__init__(own_id, command_ids(node, family), now, listen_s)
        self.status: int | None = None
        self._tpdo = slot.tpdo[0].cob_id + node.id if slot else None

    def on_frame(self, frame: Frame) -> None:
        super().on_frame(frame)
        if frame.can_id == self._tpdo and len(frame.data) >= _WORD_BYTES:
            self.status = int.from_bytes(frame.data[:_WORD_BYTES], "little")


def command_ids(node: NodeTable, family: Family) -> frozenset[int]:
    """Identifiers of the node's RPDOs: by its mapping, or where that has none by the pre-defined connection
    set."""
    mapped = frozenset(pdo.cob_id + node.id for slot in family.slot for pdo in slot.rpdo)
    return mapped or frozenset(base + node.id for base in cobid.RPDOS)


class Standstill:
    """Guard against writing protected parameters while the drive is enabled, or an output of a node that is
    no drive is anything but safe.

    ``heard`` is the status word that it has sent by itself, for a drive that cannot be asked for it;
    ``outputs`` are those of a node without a slot. Where nobody knows it, only who uses ``force`` writes.
    ``whole``: nothing else is written while it is known to be enabled either.
    """

    def __init__(
        self,
        names: Names,
        family: Family,
        slot: Slot | None,
        heard: int | None,
        *,
        force: bool,
        whole: bool = False,
        outputs: OutputWords | None = None,
    ) -> None:
        self._names = names
        self._words = StatusWords(family.status_word) if slot else None
        self._parts = slot.tpdo[0].objects[0][0].parts if slot else ()
        self._heard = heard
        self._force = force
        self._whole = whole
        self._places = tuple(outputs.places.values()) if outputs else ()

    @property
    def gate(self) -> Gate:
        """Gate for a user at the machine: an engineer; the drive itself is asked whether it moves."""
        return Gate(is_engineer=True, is_moving=lambda: False, asks=self.check)

    def concerns(self, entry: ParameterEntry) -> bool:
        effect = self._names.protection.effect(entry.address)
        return judge(effect, is_engineer=True, is_moving=True) is WriteVerdict.NOT_AT_REST

    def check(self, entries: Iterable[ParameterEntry]) -> Generator[Transfer, tuple[bytes, float], None]:
        """Check that all of them may be written now. Raises ``ParameterError`` with the names of the
        others."""
        concerned = ", ".join(entry.name for entry in entries if self.concerns(entry))
        if not concerned and not self._whole:
            return
        what = Text.of("standstill.parameters", names=concerned) if concerned else Text.of("standstill.set")
        if self._words is None:
            yield from self._check_outputs(what, must_tell=bool(concerned) and not self._force)
            return
        word = yield from self._status()
        if word is not None and self._words.state(word) in MOVING:
            raise ParameterError(Why.PROTECTED, Text.of("standstill.drive_enabled", what=what))
        if word is None and concerned and not self._force:
            raise ParameterError(Why.PROTECTED, Text.of("standstill.drive_silent", what=what))

    def _check_outputs(
        self, what: Text, *, must_tell: bool
    ) -> Generator[Transfer, tuple[bytes, float], None]:
        """Check the outputs. Raises ``ParameterError`` for the first output that the node holds at anything
        but its safe value; one that is to hold its last value is safe at 0."""
        for place in self._places:
            name = place.output.name
            try:
                data, _ = yield Transfer(place.output.object)
            except TransferFailed:
                if not must_tell:
                    continue
                said = Text.of("standstill.output_silent", what=what, output=name)
                raise ParameterError(Why.PROTECTED, said) from None
            if _is_active(place, data):
                said = Text.of("standstill.output_active", what=what, output=name)
                raise ParameterError(Why.PROTECTED, said)

    def _status(self) -> Generator[Transfer, tuple[bytes, float], int | None]:
        """Status word, read by SDO from the objects that make it up in its TPDO."""
        if not all(part.index for part in self._parts):
            return self._heard
        each = _WORD_BYTES // len(self._parts)
        word = b""
        for part in self._parts:
            try:
                data, _ = yield Transfer(part)
            except TransferFailed:
                return self._heard
            word += data[:each].ljust(each, b"\0")
        return int.from_bytes(word, "little")


def _is_active(place: OutputPlace, data: bytes) -> bool:
    """True if an output that holds these bytes is anything but safe."""
    raw = int.from_bytes(data, "little") & ((1 << place.output.size) - 1)
    return raw != (place.safe or 0)
