"""What must be known of a drive, or of a node that is none, before it is written to without its bridge.
Sans-IO."""

from __future__ import annotations

from collections.abc import Generator, Iterable

from bridge.canopen import cobid
from bridge.canopen.frame import Frame
from bridge.config import NodeTable
from bridge.drive import MOVING, StatusWords
from bridge.errands.drop_test import ForeignMaster
from bridge.mapping.model import Family, Slot
from bridge.parameter import Entry, Names, ParameterError, Transfer, TransferFailed, Why

_WORD_BYTES = 2
_LEVELS = ("communication", "while_enabled")


class Bystander(ForeignMaster):
    """Listens for whoever commands this bus; ``status`` is the status word of a TPDO that is heard. A node
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
    """On which identifiers the node is commanded: by its mapping, or where that does not say by the
    pre-defined connection set."""
    if family.is_device:
        return frozenset(base + node.id for base in cobid.RPDOS)
    return frozenset(pdo.cob_id + node.id for slot in family.slot for pdo in slot.rpdo)


class Standstill:
    """Sees to it that what is protected is not written while the drive is enabled. A node without a slot
    moves nothing.

    ``heard`` is the status word that it has sent by itself, for a drive that cannot be asked for it. Where
    nobody knows it, only who uses ``force`` writes. ``whole``: nothing else is written while it is known to
    be enabled either.
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
    ) -> None:
        self._names = names
        self._words = StatusWords(family.status_word) if slot else None
        self._parts = slot.tpdo[0].objects[0][0].parts if slot else ()
        self._heard = heard
        self._force = force
        self._whole = whole

    def concerns(self, entry: Entry) -> bool:
        return self._names.protection.level(entry.address) in _LEVELS

    def check(self, entries: Iterable[Entry]) -> Generator[Transfer, tuple[bytes, float], None]:
        """Raises ``ParameterError`` with the names of those that are not written now."""
        if self._words is None:
            return
        concerned = ", ".join(entry.name for entry in entries if self.concerns(entry))
        if not concerned and not self._whole:
            return
        word = yield from self._status()
        rule = f"{concerned or 'a set of parameters'}: not written while the drive is enabled"
        if word is not None and self._words.state(word) in MOVING:
            raise ParameterError(Why.PROTECTED, f"{rule}, and it is: stop and disable it first")
        if word is None and concerned and not self._force:
            raise ParameterError(
                Why.PROTECTED, f"{rule}, and it does not tell whether it is; --force writes all the same"
            )

    def _status(self) -> Generator[Transfer, tuple[bytes, float], int | None]:
        """The status word as the drive answers for the objects that make it up in its TPDO."""
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
