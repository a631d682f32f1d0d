"""Memory of a node from one boot-up to the next, so that none of them wears out its EEPROM, and that a stop
reaches it wherever it listens."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

from bridge.canopen.sync import LAST_SYNCHRONOUS
from bridge.config.download import COMMANDS
from bridge.mapping.aliases import COMMUNICATION
from bridge.node.boot.pdo_plan import PdoPlan
from bridge.parameter import Ledger
from bridge.text import Said

_RPDOS: Final = 2
"""Identifiers remembered for one RPDO: a node that lies does not fill the memory."""

_RESETS: Final = 3
"""Errors in a row for which a node that does not start is reset: one with ever new errors is left alone."""


@dataclass(slots=True)
class BootMemory:
    """Memory kept for as long as the bridge runs; ``start_anew`` is called when the node has restarted or an
    operator has reset it."""

    may_run: bool = True
    """True if drives may be running: the node has not restarted since it was in operation, or since the
    bridge started."""
    is_at_rest: bool = False
    """True if the node has reported a state in which its drives do not run, and has not been in operation
    since."""
    did_not_start: bool = False
    """True if the boot-up before this one got as far as the start, and the node did not follow."""
    unsaved: bool = False
    """True if something was written that has not been stored (1010h) yet."""
    unanswered_stores: int = 0
    ledger: Ledger = field(default_factory=Ledger)
    """Count of the writes to its EEPROM."""
    cycles: int | None = None
    """Number of writes that its EEPROM endures; None where it has none, or nobody says it."""
    began_at: float = float("-inf")
    """Monotonic time in seconds at which the last boot-up began."""
    _not_kept: dict[tuple[int, int], bytes] = field(default_factory=dict[tuple[int, int], bytes])
    _commands: set[tuple[int, int, bytes]] = field(default_factory=set[tuple[int, int, bytes]])
    _resets: set[tuple[int, int]] = field(default_factory=set[tuple[int, int]])
    _rpdos: dict[tuple[str, int], list[PdoPlan]] = field(default_factory=dict[tuple[str, int], list[PdoPlan]])

    def count_write(self, owner: str, address: str, name: str) -> Said:
        """Count one more write to an EEPROM, as of the boot-up's beginning: of the object ``address`` of
        ``owner``, called ``name``. Returns a warning or an empty text. Raises ``ParameterError`` where it is
        one too many (``parameter.ledger``)."""
        self.ledger.check((owner, address), name, self.began_at, self.cycles)
        return self.ledger.count((owner, address), name, self.cycles, self.began_at)

    def start_anew(self) -> None:
        self.unanswered_stores = 0
        self.did_not_start = False
        self._not_kept.clear()
        self._commands.clear()
        self._resets.clear()

    def was_reset(self) -> None:
        """Note a reset by a boot-up that failed: the communication objects are as they were stored, which is
        no reason to write the EEPROM once more."""
        self.did_not_start = False
        self._not_kept = {
            key: data
            for key, data in self._not_kept.items()
            if key[0] not in COMMUNICATION or key[0] in COMMANDS
        }

    def note_not_kept(self, index: int, sub: int, data: bytes) -> None:
        """Note bytes that the node has taken, though it holds others."""
        self._not_kept[index, sub] = data

    def was_not_kept(self, index: int, sub: int, data: bytes) -> bool:
        """Whether writing these bytes has been tried in vain."""
        return self._not_kept.get((index, sub)) == data

    def note_command(self, index: int, sub: int, data: bytes) -> None:
        """Note a command that was carried out by a boot-up that may still fail."""
        self._commands.add((index, sub, data))

    def has_done(self, index: int, sub: int, data: bytes) -> bool:
        return (index, sub, data) in self._commands

    def boot_succeeded(self) -> None:
        """Note a success: the next boot-up begins with all its commands."""
        self._commands.clear()
        self._resets.clear()
        self.may_run = True
        self.is_at_rest = self.did_not_start = False

    def may_reset_for(self, cause: tuple[int, int]) -> bool:
        """Whether a node that did not start may be reset because of this error: no drive may be running, and
        it was not tried before, since the node was in operation or somebody else has restarted it."""
        is_new = cause not in self._resets and len(self._resets) < _RESETS
        return self.did_not_start and is_new and (self.is_at_rest or not self.may_run)

    def note_reset(self, cause: tuple[int, int]) -> None:
        self._resets.add(cause)
        self.did_not_start = False

    def note_rpdo(self, drive: str, number: int, plan: PdoPlan) -> None:
        """Note an RPDO in which the node listens for the words of ``drive``."""
        known = self._rpdos.get((drive, number), [])
        others = [one for one in known if one.cob_id != plan.cob_id]
        self._rpdos[drive, number] = [*others, plan][-_RPDOS:]

    def rpdos_of(self, drive: str) -> Iterator[PdoPlan]:
        """RPDOs in which the node has listened for this drive; of one RPDO the newest plan comes last."""
        for (name, _), plans in self._rpdos.items():
            if name == drive:
                yield from plans

    @property
    def rpdo_types(self) -> set[int]:
        """Transmission types of the RPDOs that the node has named last."""
        return {plans[-1].transmission_type for plans in self._rpdos.values()}

    @property
    def waits_for_sync(self) -> bool:
        """Whether an RPDO takes effect with the next SYNC only (CiA 301 §7.5.2.35)."""
        return any(kind <= LAST_SYNCHRONOUS for kind in self.rpdo_types)
