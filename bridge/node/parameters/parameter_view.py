"""Parameters in the image: value, quality, and the time at which they were read. Sans-IO."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from bridge.command import ParameterHolder
from bridge.command.drive_link import REASONS, NodeState
from bridge.command.node import Node
from bridge.image import Image, Quality
from bridge.parameter import ObjectRef, ParameterEntry, ParameterError, ParameterReading, Why
from bridge.text import Text

_FINAL_ABORTS: Final = frozenset((0x0601_0000, 0x0601_0001, 0x0602_0000, 0x0609_0011))
"""Abort codes for what a drive does not have: asking again gives the same answer."""


NO_CHANNEL: Final = Text.of("parameter.no_channel")


class ParameterView:
    """The parameter points of one node's drives."""

    def __init__(self, node: Node, image: Image) -> None:
        self._image = image
        self._hold_s = node.table.hold_ms / 1000
        self._indices: dict[tuple[str, ObjectRef], int] = {
            (who.name, entry.address): image.index[f"{who.name}/parameter/{entry.leaf}"]
            for who in node.members
            for entry in who.spec.names.points()
        }
        self._dead_at: float | None = None

    def on_node(self, state: NodeState, now: float) -> None:
        """Judge all points anew: in the node's new state what was read from it may have changed."""
        self._dead_at = None
        match state:
            case NodeState.OPERATIONAL | NodeState.CONFIG_ERROR | NodeState.ABSENT:
                return  # values are read anew
            case NodeState.DISABLED:
                quality = Quality.DISABLED
            case NodeState.LOST:
                quality, self._dead_at = Quality.LOST, now + self._hold_s
            case _:
                quality = Quality.STALE
        self._judge(quality, now, REASONS[state])

    def unreached(self, drives: Iterable[ParameterHolder], now: float) -> None:
        """Mark the points of drives that no open SDO channel leads to."""
        names = {drive.name for drive in drives}
        for (name, _), index in self._indices.items():
            if name in names:
                self._image.judge((index,), Quality.CONFIG_ERROR, now, NO_CHANNEL)

    def on_time(self, now: float) -> None:
        if self._dead_at is not None and now >= self._dead_at:
            self._dead_at = None
            self._judge(Quality.DEAD, now, REASONS[NodeState.LOST])

    def next_deadline(self) -> float | None:
        return self._dead_at

    def _judge(self, quality: Quality, now: float, reason: Text) -> None:
        """Judge all points; one that never had a value stays waiting, unless the node is out of service."""
        for index in self._indices.values():
            if self._image[index].quality is not Quality.WAITING or quality is Quality.DISABLED:
                self._image.judge((index,), quality, now, reason)

    def show(self, drive: str, reading: ParameterReading) -> None:
        """Show a value as the drive holds it."""
        index = self._indices.get((drive, reading.entry.address))
        if index is not None:
            value = reading.value
            kind = self._image.points[index].data_type
            self._image.renew(index, float(value) if kind == "float" else value, reading.time)

    def is_final(self, error: ParameterError) -> bool:
        """Whether asking the drive again would bring the same answer."""
        return error.abort_code in _FINAL_ABORTS or error.why in (Why.NOT_CONFIGURED, Why.WRITE_ONLY)

    def failed(self, drive: str, entry: ParameterEntry, error: ParameterError, now: float) -> None:
        """Mark a point that could not be read: the last value stays, but is not current."""
        index = self._indices.get((drive, entry.address))
        if index is None:
            return
        had_value = self._image[index].quality.has_value
        if self.is_final(error):
            quality = Quality.CONFIG_ERROR
        else:
            quality = Quality.STALE if had_value else Quality.WAITING
        self._image.judge((index,), quality, now, error.said)
