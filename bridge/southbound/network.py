"""One CANopen network: its nodes, its SYNC, our own heartbeat. Sans-IO.

Says which frames are to be sent once and which are to be repeated; whoever holds the bus does it.
"""

from __future__ import annotations

from functools import partial

from bridge.command import Plant
from bridge.config import BusTable
from bridge.southbound.bus.frame import Frame
from bridge.southbound.bus.interface import BusStatus, ControllerState
from bridge.southbound.canopen import cobid
from bridge.southbound.canopen.nmt import NmtState
from bridge.southbound.canopen.sync import SYNC_FRAME
from bridge.southbound.node import Handler, NodeCore

_OVERHEAD_BITS = 47
"""Bits of a standard data frame without data and stuff bits, interframe space included."""


def frame_bits(length: int) -> int:
    """Bits on the wire of a data frame with ``length`` bytes: worst-case stuffing counted half."""
    payload = 8 * length
    return _OVERHEAD_BITS + payload + (33 + payload) // 8


class Network:
    """All configured nodes of one bus."""

    def __init__(self, bus: BusTable, plant: Plant) -> None:
        self.bus = bus
        self._plant = plant
        self.nodes = [NodeCore(node, plant) for node in plant.nodes.values() if node.bus is bus]
        for node in self.nodes:
            node.is_taken = partial(self._is_taken, node)
        self.unrouted = 0
        self._routes: dict[int, Handler] = {}
        self._bits = 0
        self._measured_at: float | None = None
        self.beats_bits_per_s = 0.0

    def _is_taken(self, by: NodeCore, cob_id: int) -> bool:
        others = (node for node in self.nodes if node is not by)
        return any(
            cob_id in node.routes or cob_id in (pdos.cob_id for pdos in node.drives.values())
            for node in others
        )

    def on_frames(self, frames: list[Frame], now: float) -> None:
        """Everything received, in order. A frame nobody waits for is counted."""
        routes = self._routes
        for frame in frames:
            handler = routes.get(frame.can_id)
            self._bits += frame_bits(len(frame.data))
            if handler is None:
                self.unrouted += 1
            else:
                handler(frame)
        for node in self.nodes:
            node.pump(now)

    def on_time(self, now: float) -> None:
        for node in self.nodes:
            node.on_time(now)
            node.pump(now)

    def next_deadline(self) -> float | None:
        times = [time for node in self.nodes if (time := node.next_deadline()) is not None]
        return min(times) if times else None

    def take_frames(self) -> list[Frame]:
        """Frames to be sent once, now."""
        frames = [frame for node in self.nodes for frame in node.take_frames()]
        self._bits += sum(frame_bits(len(frame.data)) for frame in frames)
        return frames

    def take_routes(self) -> list[int] | None:
        """The identifiers to be received, if they have changed since the last call."""
        if not any(node.routes_changed for node in self.nodes) and self._routes:
            return None
        self._routes = {}
        for node in self.nodes:
            node.routes_changed = False
            self._routes.update(node.routes)
        return list(self._routes)

    def beats(self) -> dict[int, tuple[Frame, float]]:
        """The frames to be repeated and their periods in seconds, by COB-ID."""
        beats: dict[int, tuple[Frame, float]] = {}
        if self.bus.sync_period_ms:
            beats[cobid.SYNC] = (SYNC_FRAME, self.bus.sync_period_ms / 1000)
        if self.bus.heartbeat_ms:
            frame = Frame(cobid.ERROR_CONTROL + self.bus.master_node_id, bytes((NmtState.OPERATIONAL,)))
            beats[frame.can_id] = (frame, self.bus.heartbeat_ms / 1000)
        period_s = self.bus.rpdo_period_s
        for node in self.nodes:
            if node.sends_process_data:
                for pdos in node.drives.values():
                    if not pdos.is_silent:
                        beats[pdos.cob_id] = (pdos.rpdo(), period_s)
        self.beats_bits_per_s = sum(frame_bits(len(frame.data)) / period for frame, period in beats.values())
        return beats

    def bus_is_gone(self, now: float) -> None:
        for node in self.nodes:
            node.bus_is_gone(now)

    def refresh(self, status: BusStatus, now: float) -> None:
        """Bring the points of the bus and its nodes up to date; a few times a second."""
        top = f"bus/{self.bus.name}"
        self._plant.set(f"{top}/state", int(status.state), now)
        self._plant.set(f"{top}/tx_errors", status.tx_errors, now)
        self._plant.set(f"{top}/rx_errors", status.rx_errors, now)
        self._plant.set(f"{top}/frames_lost", status.frames_lost, now)
        if self._measured_at is None:
            self._measured_at = now
        elif now >= self._measured_at + 1.0:
            beats = 0.0 if status.state is ControllerState.DOWN else self.beats_bits_per_s
            bits_per_s = self._bits / (now - self._measured_at) + beats
            self._plant.set(f"{top}/load", round(min(100.0, 100 * bits_per_s / self.bus.bitrate), 1), now)
            self._bits = 0
            self._measured_at = now
        for node in self.nodes:
            node.refresh(now)
