"""TPDOs of a device that is no drive: its inputs."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from bridge.canopen.frame import Frame
from bridge.canopen.sync import tpdo_deadline_s
from bridge.command.device import Device, InputPdo
from bridge.mapping.entry_types import ObjectRef
from bridge.node.boot import PdoPlan, SignalPlan
from bridge.node.process.unfit_frames import UnfitFrames
from bridge.text import Text


def connect_inputs(
    device: Device, plan: SignalPlan, sync_period_ms: int, unfit: UnfitFrames, now: float
) -> dict[int, Callable[[Frame], None]]:
    """Tell ``device`` what the boot-up has found; returns the handlers of its TPDOs, by COB-ID."""
    device.on_pdos([_input_pdo(tpdo, sync_period_ms) for tpdo in plan.pdos], plan.unserved, now)
    return {
        tpdo.cob_id: partial(_on_frame, device, place, tpdo, unfit) for place, tpdo in enumerate(plan.pdos)
    }


def _input_pdo(tpdo: PdoPlan, sync_period_ms: int) -> InputPdo:
    objects = tuple(
        None if entry.is_dummy else ObjectRef(entry.index, entry.sub) for entry in tpdo.codec.entries
    )
    deadline_s = tpdo_deadline_s(tpdo.transmission_type, tpdo.event_timer_ms, sync_period_ms)
    return InputPdo(tpdo.name, objects, deadline_s)


def _on_frame(device: Device, place: int, tpdo: PdoPlan, unfit: UnfitFrames, frame: Frame) -> None:
    length = tpdo.codec.length
    if len(frame.data) != length:
        unfit.reject(frame, Text.of("frame.bytes_mapped", length=length))
        if len(frame.data) < length:
            return
    device.on_data(place, tpdo.codec.unpack(frame.data[:length]), frame.time)
