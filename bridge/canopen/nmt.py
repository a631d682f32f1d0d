"""Network management (CiA 301 §7.2.8): commands of the master, states of the nodes."""

from __future__ import annotations

from enum import IntEnum
from typing import Final

from bridge.canopen import cobid
from bridge.canopen.frame import Frame


class NmtCommand(IntEnum):
    START = 0x01
    STOP = 0x02
    ENTER_PRE_OPERATIONAL = 0x80
    RESET_NODE = 0x81
    RESET_COMMUNICATION = 0x82


class NmtState(IntEnum):
    """NMT states as heartbeats and guarding answers report them."""

    INITIALISING = 0x00
    STOPPED = 0x04
    OPERATIONAL = 0x05
    PRE_OPERATIONAL = 0x7F
    UNKNOWN = 0xFF

    @property
    def label(self) -> str:
        return self.name.lower()

    @property
    def words(self) -> str:
        """Name of the state in sentences."""
        return self.label.replace("_", "-") if self is NmtState.PRE_OPERATIONAL else self.label


def command(what: NmtCommand, node_id: int) -> Frame:
    """The NMT frame for one node, or for all with ``node_id`` 0."""
    return Frame(cobid.NMT, bytes((what, node_id)))


_BY_OCTET: Final = {state.value: state for state in NmtState if state is not NmtState.UNKNOWN}


def state_of(octet: int) -> NmtState:
    """The NMT state in an error control message; bit 7 is the toggle bit of guarding."""
    return _BY_OCTET.get(octet & 0x7F, NmtState.UNKNOWN)


def command_name(octet: int) -> str:
    try:
        return NmtCommand(octet).name.lower().replace("_", " ")
    except ValueError:
        return f"unknown command {octet:02X}h"


def describe(data: bytes) -> str:
    """An NMT command on the wire, in words."""
    if len(data) != 2:
        return f"{data.hex().upper() or 'nothing'} (not an NMT command)"
    return f"{command_name(data[0])} for {f'node {data[1]}' if data[1] else 'all nodes'}"
