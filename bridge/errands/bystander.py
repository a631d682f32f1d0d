"""What must be known of a drive before it is written to without its bridge. Sans-IO."""

from __future__ import annotations

from collections.abc import Generator, Iterable

from bridge.canopen.frame import Frame
from bridge.config import NodeTable
from bridge.drive import MOVING, StatusWords
from bridge.errands.drop_test import ForeignMaster
from bridge.mapping.model import Family, Slot
from bridge.parameter import Entry, Names, ParameterError, Transfer, TransferFailed, Why

_WORD_BYTES = 2
_LEVELS = ("communication", "while_enabled")


class Bystander(ForeignMaster):
    """Listens for whoever commands this bus; ``status`` is the status word of a TPDO that is heard."""

    def __init__(self, own_id: int, node: NodeTable, family: Family, slot: Slot, now: float, listen_s: float):
        commands = frozenset(pdo.cob_id + node.id for each in family.slot for pdo in each.rpdo)
        super().__init__(own_id, commands, now, listen_s)
        self.status: int | None = None
        self._tpdo = slot.tpdo[0].cob_id + node.id

    def on_frame(self, frame: Frame) -> None:
        super().on_frame(frame)
        if frame.can_id == self._tpdo and len(frame.data) >= _WORD_BYTES:
            self.status = int.from_bytes(frame.data[:_WORD_BYTES], "little")


class Standstill:
    """Sees to it that what is protected is not written while the drive is enabled.

    ``heard`` is the status word that it has sent by itself, for a drive that cannot be asked for it. Where
    nobody knows it, only who uses ``force`` writes. ``whole``: nothing else is written while it is known to
    be enabled either.
    """

    def __init__(
        self,
        names: Names,
        family: Family,
        slot: Slot,
        heard: int | None,
        *,
        force: bool,
        whole: bool = False,
    ) -> None:
        self._names = names
        self._words = StatusWords(family.status_word)
        self._parts = slot.tpdo[0].objects[0][0].parts
        self._heard = heard
        self._force = force
        self._whole = whole

    def concerns(self, entry: Entry) -> bool:
        return self._names.protection.level(entry.address) in _LEVELS

    def check(self, entries: Iterable[Entry]) -> Generator[Transfer, tuple[bytes, float], None]:
        """Raises ``ParameterError`` with the names of those that are not written now."""
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
