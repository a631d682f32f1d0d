"""Procedure on one drive's parameters as a task for the command line. Sans-IO."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Generic, TypeVar

from bridge.bustools.task import NOTHING_KNOWN, SdoTasks
from bridge.canopen import cobid
from bridge.canopen.sdo import SdoChannel
from bridge.config import NodeTable
from bridge.mapping.model import Family, Slot
from bridge.node.parameters.run import Procedure, run
from bridge.parameter import ParameterError, Transfer

T = TypeVar("T")


class ParameterTask(SdoTasks, Generic[T]):
    """Task that runs a procedure. A node that is no drive has no slot. ``make`` gives the procedure for the
    present time. ``known`` says by the COB-ID of its requests why a server is not asked for block transfer.
    ``result`` is None until it has ended."""

    def __init__(
        self,
        node: NodeTable,
        family: Family,
        slot: Slot | None,
        make: Callable[[float], Procedure[T]],
        now: float,
        known: Mapping[int, str] = NOTHING_KNOWN,
    ) -> None:
        self.result: T | ParameterError | None = None
        self.is_done = False

        def channel(request: int, reply: int) -> SdoChannel:
            return SdoChannel(
                request + node.id,
                reply + node.id,
                node.sdo_timeout_ms / 1000,
                retries=node.sdo_retries,
                why_no_block=known.get(request + node.id, ""),
            )

        self._first = self._of_drive = channel(cobid.SDO_REQUEST, cobid.SDO_REPLY)
        if slot and not slot.parameters_by_sdo:
            server = next((server for server in family.sdo if server.slot == slot.name), None)
            if server is not None:
                self._of_drive = channel(server.request, server.reply)
        super().__init__((self._first, self._of_drive), now)
        run(make(now), self._channel_for, lambda: self._now, self._done)

    def _channel_for(self, transfer: Transfer) -> SdoChannel:
        return self._first if transfer.of_node else self._of_drive

    def _done(self, result: T | ParameterError) -> None:
        self.result = result
        self.is_done = True

    def is_finished(self, now: float) -> bool:
        return self.is_done
