"""Opening of a node's further SDO servers as in its boot-up, to reach all of its drives. Sans-IO."""

from __future__ import annotations

from bridge.bustools.task import SdoTasks
from bridge.canopen import nmt
from bridge.canopen.dialogue import Dialogue, SdoRead, SdoWrite, ask
from bridge.canopen.frame import Frame
from bridge.canopen.sdo import SdoError
from bridge.catalogue import NodeSpec
from bridge.node.boot import Action, BootError, BootResult, SendNmt
from bridge.node.boot.sdo_servers import open_sdo_servers
from bridge.node.places.sdo_channels import FIRST, SdoChannels
from bridge.text import render

_Failure = SdoError | BootError


class OpenChannels(SdoTasks):
    """Task that opens them. ``notes`` lists those that were opened, ``failure`` is the reason why one could
    not be."""

    def __init__(self, node: NodeSpec, now: float) -> None:
        self._sdo = SdoChannels(node)
        super().__init__(self._sdo, now)
        self.failure = ""
        self._result = BootResult()
        self._node_id = node.table.id
        self._is_done = False
        self._dialogue = Dialogue[Action, bytes | None, None, _Failure](
            open_sdo_servers(node, self._result), self._do, self._end, (SdoError, BootError)
        )
        self._dialogue.go_on(None, now)

    @property
    def notes(self) -> list[str]:
        return [render(note) for note in self._result.notes]

    def _do(self, step: Action, now: float) -> bool:
        if isinstance(step, SdoRead | SdoWrite):
            ask(step, self._sdo[FIRST], now, lambda answer: self._dialogue.go_on(answer, self._now))
            return True
        if isinstance(step, SendNmt):
            self._frames.append(nmt.command(step.command, self._node_id))
        return False

    def _end(self, end: _Failure | None, now: float) -> None:
        del now
        self._is_done = True
        self.failure = "" if end is None else str(end)

    def is_finished(self, now: float) -> bool:
        return self._is_done and not self._frames

    def take_frames(self) -> list[Frame]:
        own, self._frames = self._frames, []
        return [*super().take_frames(), *own]
