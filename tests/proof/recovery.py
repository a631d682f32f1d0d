"""How an owner brings a stopped drive back: acknowledge, a word that does not enable, a fresh enable."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from tests.proof.drives import Drive
    from tests.proof.rig import Rig
    from tests.proof.witness import Run

_PATIENCE_S: Final = 1.5
_MOST_PATIENCE_S: Final = 12.0
"""After some tries twice as long each time: a slow machine may take seconds for a telegram."""
_QUICK_TRIES: Final = 6
"""As long as a node may take to be booted."""


class Recovery:
    """One drive; ``step`` again and again until it says that the drive moves."""

    def __init__(self, rig: Rig, drive: Drive, *, anew: bool = False) -> None:
        """``anew``: also where the drive moves, because its trip is only reported."""
        self._rig = rig
        self._drive = drive
        self._word = drive.family.run
        self._since = float("-inf")
        self._accepted = 0
        self._patience_s = _PATIENCE_S
        self._tries = 0
        if anew:
            self._tell(drive.family.acknowledge)

    def step(self, now: float) -> bool:
        family = self._drive.family
        waited = now - self._since
        if self._word == family.acknowledge and self._is_acknowledged():
            self._tell(family.ready)
        elif self._word == family.ready and self._is_ready():
            self._tell(family.run)
        elif self._word == family.run and self._rig.moves(self._drive):
            return True
        elif waited > self._patience_s:
            # Not yet: the node may still be booting. Once more from the start.
            self._tries += 1
            if self._tries > _QUICK_TRIES:
                self._patience_s = min(2 * self._patience_s, _MOST_PATIENCE_S)
            self._tell(family.acknowledge)
        return False

    def _tell(self, word: int) -> None:
        self._word = word
        self._since = time.monotonic()
        self._accepted, _ = self._rig.board.accepted(self._drive.place)
        self._rig.board.command(self._drive.place, word)

    def _is_acknowledged(self) -> bool:
        accepted, word = self._rig.board.accepted(self._drive.place)
        return accepted > self._accepted and word == self._word

    def _is_ready(self) -> bool:
        """The bridge hands on what the owner writes."""
        told = self._rig.told.last(self._drive.rpdo)
        return told is not None and self._drive.control_word(told.data) == self._drive.family.ready

    def __str__(self) -> str:
        drive = self._drive
        told, said = self._rig.told.last(drive.rpdo), self._rig.said.last(drive.tpdo)
        return (
            f"{drive.path} ({drive.protocol}) does not move: owner writes {self._word:04X}h, "
            f"{self._rig.board.accepted(drive.place)[0]} telegrams accepted, "
            f"the bridge sends {_hex(told)}, it says {_hex(said)}"
        )


def _hex(run: Run | None) -> str:
    return run.data.hex(" ") if run else "nothing"
