"""State of a network interface, requested from the kernel by rtnetlink (<linux/rtnetlink.h>).

One message answers everything: whether it is up, its bit rate, the controller's state and error
counters (<linux/can/netlink.h>), and how many frames have passed. So no `ip` has to be installed.
"""

from __future__ import annotations

import errno
import os
import socket
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

_HEAD: Final = struct.Struct("=IHHII")  # nlmsghdr
_INFO: Final = struct.Struct("=BxHiII")  # ifinfomsg
_ATTRIBUTE: Final = struct.Struct("=HH")
_RTM_NEWLINK: Final = 16
_RTM_GETLINK: Final = 18
_NLMSG_ERROR: Final = 2
_NLM_F_REQUEST: Final = 1
_IFF_UP: Final = 1
_IFLA_IFNAME: Final = 3
_IFLA_LINKINFO: Final = 18
_IFLA_STATS64: Final = 23
_INFO_KIND: Final = 1
_INFO_DATA: Final = 2
_CAN_BITTIMING: Final = 1
_CAN_STATE: Final = 4
_CAN_BERR_COUNTER: Final = 8
_TYPE_MASK: Final = 0x3FFF  # without NLA_F_NESTED and NLA_F_NET_BYTEORDER
_ANSWER: Final = 1 << 15
_LONGEST_NAME: Final = 15
_TIMEOUT_S: Final = 0.2


@dataclass(frozen=True, slots=True)
class Link:
    """One interface. What it does not have (a vcan has no bit rate) is None.

    ``state`` is CAN_STATE_…: 0 active, 1 warning, 2 passive, 3 bus-off, 4 stopped. ``frames`` and
    ``data_bytes`` count what has passed in both directions.
    """

    is_up: bool
    kind: str | None = None
    bitrate: int | None = None
    state: int | None = None
    tx_errors: int | None = None
    rx_errors: int | None = None
    frames: int = 0
    data_bytes: int = 0


def query(channel: str) -> Link:
    """Ask the kernel about ``channel``. Raises OSError: ENODEV where there is no such interface."""
    name = os.fsencode(channel)
    if len(name) > _LONGEST_NAME or not name:
        raise OSError(errno.ENODEV, os.strerror(errno.ENODEV))
    with socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, socket.NETLINK_ROUTE) as kernel:
        kernel.settimeout(_TIMEOUT_S)
        kernel.send(request(name))
        return parse(kernel.recv(_ANSWER))


def look_at(channel: str) -> Link:
    """Result of ``query``; where the kernel may not be asked, an interface that is up and says nothing
    else."""
    try:
        return query(channel)
    except OSError as error:
        if error.errno in (errno.ENODEV, errno.ENXIO):
            raise
        return Link(is_up=True)


def request(name: bytes) -> bytes:
    """The message that asks about the interface ``name``."""
    value = name + b"\0"
    attribute = _ATTRIBUTE.pack(_ATTRIBUTE.size + len(value), _IFLA_IFNAME) + value
    body = _INFO.pack(socket.AF_UNSPEC, 0, 0, 0, 0) + attribute + bytes(-len(attribute) % 4)
    return _HEAD.pack(_HEAD.size + len(body), _RTM_GETLINK, _NLM_F_REQUEST, 1, 0) + body


def parse(answer: bytes) -> Link:
    """The answer to ``request``. Raises OSError with the kernel's errno, or EBADMSG."""
    try:
        length, kind, _, _, _ = _HEAD.unpack_from(answer)
        if kind == _NLMSG_ERROR:
            number = -struct.unpack_from("=i", answer, _HEAD.size)[0]
            raise OSError(number, os.strerror(number))
        if kind != _RTM_NEWLINK:
            raise OSError(errno.EBADMSG, f"netlink message {kind}")
        flags = _INFO.unpack_from(answer, _HEAD.size)[3]
        return _link(bool(flags & _IFF_UP), answer[_HEAD.size + _INFO.size : length])
    except struct.error as error:
        raise OSError(errno.EBADMSG, str(error)) from error


def _attributes(data: bytes) -> Iterator[tuple[int, bytes]]:
    place = 0
    while place + _ATTRIBUTE.size <= len(data):
        length, kind = _ATTRIBUTE.unpack_from(data, place)
        if length < _ATTRIBUTE.size:
            return
        yield kind & _TYPE_MASK, data[place + _ATTRIBUTE.size : place + length]
        place += (length + 3) & ~3


def _link(is_up: bool, data: bytes) -> Link:
    attributes = dict(_attributes(data))
    info = dict(_attributes(attributes.get(_IFLA_LINKINFO, b"")))
    kind = info.get(_INFO_KIND, b"").rstrip(b"\0").decode(errors="replace") or None
    can = dict(_attributes(info.get(_INFO_DATA, b""))) if kind in ("can", "slcan") else {}
    counters = can.get(_CAN_BERR_COUNTER)
    tx_errors, rx_errors = struct.unpack_from("=HH", counters) if counters else (None, None)
    statistics = attributes.get(_IFLA_STATS64, b"").ljust(32, b"\0")
    rx_packets, tx_packets, rx_bytes, tx_bytes = struct.unpack_from("=4Q", statistics)
    if kind == "vcan":
        # A vcan loops every frame back and counts it twice.
        rx_packets = rx_bytes = 0
    return Link(
        is_up,
        kind,
        _u32(can.get(_CAN_BITTIMING)) or None,
        _u32(can.get(_CAN_STATE)),
        tx_errors,
        rx_errors,
        rx_packets + tx_packets,
        rx_bytes + tx_bytes,
    )


def _u32(value: bytes | None) -> int | None:
    return struct.unpack_from("=I", value)[0] if value is not None and len(value) >= 4 else None
