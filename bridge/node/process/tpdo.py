"""TPDOs of a node that belong to none of its drives: they carry values that would be polled otherwise."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from bridge.canopen.frame import Frame
from bridge.canopen.sync import tpdo_deadline_s
from bridge.node.boot import NodePdoPlan
from bridge.node.process.polling import Polling
from bridge.node.process.unfit_frames import UnfitFrames
from bridge.text import Text


def node_tpdos(
    plans: Sequence[NodePdoPlan], sync_period_ms: int, polling: Polling, unfit: UnfitFrames
) -> dict[int, Callable[[Frame], None]]:
    """Handlers of these TPDOs, by COB-ID."""
    return {plan.pdo.cob_id: NodeTpdoReader(plan, sync_period_ms, polling, unfit).on_frame for plan in plans}


class NodeTpdoReader:
    """Reader of one such TPDO. ``polling`` gets its values, and need not ask for them by SDO for a while."""

    def __init__(
        self,
        plan: NodePdoPlan,
        sync_period_ms: int,
        polling: Polling,
        unfit: UnfitFrames,
    ) -> None:
        pdo = plan.pdo
        self._codec = pdo.codec
        self._names = plan.names
        self._polling = polling
        self._unfit = unfit
        deadline_s = tpdo_deadline_s(pdo.transmission_type, pdo.event_timer_ms, sync_period_ms)
        self._holds_s = float("inf") if deadline_s is None else deadline_s

    def on_frame(self, frame: Frame) -> None:
        length = self._codec.length
        if len(frame.data) != length:
            self._unfit.reject(frame, Text.of("frame.bytes_mapped", length=length))
            if len(frame.data) < length:
                return
        values = self._codec.unpack(frame.data[:length])
        for name, value in zip(self._names, values, strict=True):
            if name:
                self._polling.on_pdo(name, value, frame.time, frame.time + self._holds_s)
