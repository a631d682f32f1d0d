"""The command line that all bridges of the end-to-end figures have."""

from __future__ import annotations

import argparse
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Ports:
    """Where a bridge serves, its end of the bus, and how many nodes are there."""

    channel: str
    nodes: int
    modbus: int
    opcua: int
    zenoh: int

    @property
    def arguments(self) -> list[str]:
        return [self.channel, *map(str, (self.nodes, self.modbus, self.opcua, self.zenoh))]


def ports() -> Ports:
    """``CHANNEL NODES MODBUS OPCUA ZENOH`` of the command line."""
    parser = argparse.ArgumentParser()
    parser.add_argument(
        "channel", help="vcan0, or fd:N,M: an end of a pair of sockets, and the broadcast manager's"
    )
    for name in ("nodes", "modbus", "opcua", "zenoh"):
        parser.add_argument(name, type=int)
    return Ports(**vars(parser.parse_args()))
