"""Keeps the counts of the EEPROM guard across restarts, beside the bus and not in its way."""

from __future__ import annotations

import asyncio
import logging
from pathlib import Path
from typing import Final

from bridge.base import clock
from bridge.parameter import Ledger
from bridge.parameter.ledger_file import LedgerFile

_log = logging.getLogger(__name__)

_PERIOD_S: Final = 1.0
"""Period of keeping the counts, seconds: writes within it before a crash are not counted."""


class WearKeeper:
    """Writes the counts of ``ledger`` to the site's ``state_dir`` as they grow.

    A folder that cannot be written stops nothing: it is told once, and the counts go on in memory.
    """

    def __init__(self, ledger: Ledger, state_dir: Path) -> None:
        self._ledger = ledger
        self._file = LedgerFile(state_dir)
        self._fault = ""

    async def run(self) -> None:
        """Keep the counts as they grow, until cancelled."""
        while True:
            await asyncio.sleep(_PERIOD_S)
            unsaved = self._ledger.take_unsaved()
            if not unsaved:
                continue
            epoch_s = _epoch_s()
            writes = {key: [epoch_s + time for time in times] for key, times in unsaved.items()}
            storing = asyncio.create_task(asyncio.to_thread(self._file.merge, writes))
            try:
                # A thread cannot be cancelled: what it stores must not be stored again at the end.
                totals = await asyncio.shield(storing)
            except OSError as error:
                self._ledger.put_back(unsaved)
                self._tell(error)
            except asyncio.CancelledError:
                await asyncio.wait((storing,))
                raise
            else:
                self._ledger.restore(totals, epoch_s, clock.now())

    def keep(self) -> None:
        """Write the new counts to the file, and take over those in it."""
        try:
            self._file.add(self._ledger, _epoch_s(), clock.now())
        except OSError as error:
            self._tell(error)
        if self._file.damaged:
            _log.error("%s could not be read: put aside as %s", self._file.path, self._file.damaged)
            self._file.damaged = ""

    def _tell(self, error: OSError) -> None:
        reason = error.strerror or str(error)
        if reason != self._fault:
            self._fault = reason
            _log.error("EEPROM writes are not kept in %s: %s", self._file.path, reason)


def _epoch_s() -> float:
    """The wall clock at monotonic 0, in seconds since 1970."""
    return clock.epoch_ns(0.0) / 1e9
