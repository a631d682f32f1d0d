"""The end of a CAN bus that a peer is given as an argument: an interface, or an open Unix socket."""

import contextlib
import socket
import struct
from collections.abc import Iterator

FRAME = struct.Struct("=IB3x8s")
_SO_TIMESTAMPNS = 35


@contextlib.contextmanager
def can_end(channel: str, *filters: tuple[int, int]) -> Iterator[socket.socket]:
    """``vcan0``, or ``fd:5`` for the inherited socket 5, which carries ``struct can_frame`` as well. Only
    frames of ``filters`` (identifier, mask) come from an interface; a pair of sockets has no filter."""
    number = channel.removeprefix("fd:")
    if number != channel:
        end = socket.socket(fileno=int(number))
    else:
        end = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        if filters:
            packed = b"".join(struct.pack("=II", *pair) for pair in filters)
            end.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, packed)
        end.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 21)
        end.bind((channel,))
    with end:
        end.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
        yield end
