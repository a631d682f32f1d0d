"""The sockets of zenoh's connections, as far as zenoh does not leave them as we need them."""

from __future__ import annotations

import os
import socket
import stat
import struct
from contextlib import suppress
from pathlib import Path
from typing import Final

_OFF: Final = struct.pack("ii", 0, 0)
_IP: Final = (socket.AF_INET, socket.AF_INET6)
_FILES: Final = Path("/proc/self/fd")


def close_without_waiting() -> int:
    """Let no connection of this process wait when it is closed; gives how many would have.

    zenoh has ``close`` wait for 10 s until the peer has read everything (SO_LINGER, socket(7)), on one of the
    two threads that read for all connections: two clients that hang, and nobody is heard any more.
    """
    found = 0
    for file in list(_FILES.iterdir()):
        with suppress(OSError):
            found += _stop_waiting(int(file.name))
    return found


def _stop_waiting(number: int) -> bool:
    # It may be closed, and its number be another's, at any moment: what is asked and set is our own copy's.
    copy = os.dup(number)
    if not stat.S_ISSOCK(os.fstat(copy).st_mode):
        os.close(copy)
        return False
    with socket.socket(fileno=copy) as connection:
        if connection.family not in _IP or connection.type != socket.SOCK_STREAM:
            return False
        state = connection.getsockopt(socket.SOL_SOCKET, socket.SO_LINGER, len(_OFF))
        if state[: len(_OFF) // 2] == _OFF[: len(_OFF) // 2]:
            return False
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _OFF)
        return True
