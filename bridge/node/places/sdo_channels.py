"""The SDO channels of one node: the first, and those that the site file has opened. Sans-IO.

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
"""A frame of eight bytes with the most stuff bits and the pause behind it (ISO 11898-1)."""
_SHARE: Final = 0.5
"""How much of the bus a block transfer may take."""


def opened_servers(node: Node | NodeSpec) -> list[SdoServer]:
    """The further servers that the site file wants to be used, in its order."""
    servers = {server.number: server for server in node.family.sdo}
    return [servers[number] for number in node.table.sdo_channels if number in servers]


class SdoChannels:
    """By number: 1 is the server of object 1200h."""

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
        """One that keeps polls out of the way of boot-up and commands, where there is one that reaches the
        same objects as the first."""

    def __getitem__(self, number: int) -> SdoChannel:
        """Raises KeyError where this channel is not open."""
        return self._channels[number]

    def __iter__(self) -> Iterator[SdoChannel]:
        return iter(self._all)

    @property
    def unmatched(self) -> int:
        """Frames on the reply COB-IDs that were no answer."""
        return sum(channel.unmatched for channel in self._all)

    def take_learned(self) -> list[Learned]:
        """Why block transfer is not used any more on a channel, once for each."""
        return [why for channel in self._all if (why := channel.take_learned())]

    def forget_block(self) -> None:
        """Another device is there: what was learned of the one before does not count."""
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
