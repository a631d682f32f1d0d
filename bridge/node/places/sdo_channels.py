"""SDO channels of one node: the first, and those that the site file has opened. Sans-IO.

Each has one transfer at a time; channels do not wait for each other.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from bridge.canopen import cobid
from bridge.canopen.frame import Frame
from bridge.canopen.sdo import SdoChannel
from bridge.canopen.sdo_block import Learned
from bridge.catalogue import FIRST_CHANNEL as FIRST
from bridge.catalogue import NodeSpec
from bridge.command.node import Node
from bridge.mapping.model import SdoServer

_SEGMENT_BITS: Final = 135
"""Bits of a frame of eight bytes with the most stuff bits and the pause behind it (ISO 11898-1)."""
_SHARE: Final = 0.5
"""Share of the bus that a block transfer may take."""


def opened_servers(node: Node | NodeSpec) -> list[SdoServer]:
    """Further SDO servers that the site file opens, in its order."""
    servers = {server.number: server for server in node.family.sdo}
    return [servers[number] for number in node.table.sdo_channels if number in servers]


class SdoChannels:
    """SDO channels of a node by number: 1 is the server of object 1200h."""

    def __init__(self, node: Node | NodeSpec) -> None:
        table = node.table
        segment_s = _SEGMENT_BITS / node.bus.bitrate / _SHARE

        def channel(request: int, reply: int) -> SdoChannel:
            return SdoChannel(
                request + table.id,
                reply + table.id,
                table.sdo_timeout_ms / 1000,
                retries=table.sdo_retries,
                segment_s=segment_s,
            )

        self._channels = {FIRST: channel(cobid.SDO_REQUEST, cobid.SDO_REPLY)}
        self._channels |= {
            server.number: channel(server.request, server.reply) for server in opened_servers(node)
        }
        self._all = tuple(self._channels.values())
        same = (server.number for server in opened_servers(node) if server.slot is None)
        self.for_polls = self._channels[next(same, FIRST)]
        """Channel that keeps polls out of the way of boot-up and commands, if one reaches the same objects as
        the first; else the first."""

    def __getitem__(self, number: int) -> SdoChannel:
        """Channel of this number. Raises KeyError where it is not open."""
        return self._channels[number]

    def __iter__(self) -> Iterator[SdoChannel]:
        return iter(self._all)

    @property
    def unmatched(self) -> int:
        """Number of frames on the reply COB-IDs that were no answer."""
        return sum(channel.unmatched for channel in self._all)

    def take_learned(self) -> list[Learned]:
        """Reasons why a channel no longer uses block transfer, each told once."""
        return [why for channel in self._all if (why := channel.take_learned())]

    def forget_block(self) -> None:
        """Forget what was learned of block transfer: another device is there."""
        for channel in self._all:
            channel.forget_block()

    def take_frames(self) -> list[Frame]:
        return [frame for channel in self._all for frame in channel.take_frames()]

    def on_time(self, now: float) -> None:
        for channel in self._all:
            channel.on_time(now)

    def next_deadline(self) -> float | None:
        times = (channel.next_deadline() for channel in self._all)
        return min((time for time in times if time is not None), default=None)

    def flush(self, now: float) -> None:
        """End every transfer: the node or the bus is gone."""
        for channel in self._all:
            channel.flush(now)
