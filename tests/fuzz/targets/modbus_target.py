"""Modbus TCP: MBAP and PDU, many in one go, in pieces, and clients that leave or do not listen."""

from __future__ import annotations

import contextlib
import select
import socket
import struct
import time
from random import Random
from typing import Final

from tests.fuzz.case import Case, load
from tests.fuzz.mutate import Mutator
from tests.fuzz.rig import STRANGER, Rig

_HEADER: Final = struct.Struct(">HHHB")
_UNITS: Final = (0, 1, 2, 3, 4, 5, 6, 7, 8, 247, 248, 255)
_QUIET_S: Final = 0.005
_ANSWER_S: Final = 0.05
_MOST_DEAF: Final = 200


class Thrower:
    """One connection after the other; each serves until the bridge closes it."""

    def __init__(self, rig: Rig, random: Random) -> None:
        self._port = rig.modbus
        self._random = random
        self._mutator = Mutator(random, "big")
        self._frames = load("modbus").parts("stream")
        self._socket: socket.socket | None = None

    def case(self) -> Case:
        kind = self._random.choices(("stream", "slow", "reset", "deaf"), (80, 10, 8, 2))[0]
        many = self._random.choice((1, 1, 1, 2, 5, 20, 100)) if kind != "deaf" else _MOST_DEAF
        stream = b"".join(self._frame() for _ in range(many))
        return Case(kind, tuple(self._mutator.cut(stream)))

    def _frame(self) -> bytes:
        """A recorded frame, as it is, with another PDU and the length that fits, or changed anywhere."""
        frame = self._random.choice(self._frames)
        how = self._random.randrange(20)
        if how == 0:
            return frame
        if how < 4:
            return self._mutator.mutate(frame, self._frames)
        transaction, protocol, _, unit = _HEADER.unpack_from(frame)
        others = [other[_HEADER.size :] for other in self._frames]
        pdu = self._mutator.mutate(frame[_HEADER.size :], others)[:253] or b"\x03"
        if self._random.randrange(3) == 0:
            unit = self._random.choice(_UNITS)
        return _HEADER.pack(transaction, protocol, len(pdu) + 1, unit) + pdu

    def throw(self, case: Case) -> None:
        try:
            self._throw(case)
        except OSError:
            self._drop()

    def _throw(self, case: Case) -> None:
        sock = self._connected()
        for part in case.parts:
            sock.sendall(part)
            if case.kind == "slow":
                time.sleep(0.01)
        if case.kind == "reset":
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            self._drop()
        elif case.kind == "deaf":
            self._drop()
        else:
            self._listen(sock)

    def _listen(self, sock: socket.socket) -> None:
        pause_s = _ANSWER_S
        while select.select([sock], [], [], pause_s)[0]:
            if not sock.recv(65536):
                self._drop()
                return
            pause_s = _QUIET_S

    def _connected(self) -> socket.socket:
        if self._socket is None:
            # From an address of its own: on Modbus that is who one is.
            self._socket = socket.create_connection(
                ("127.0.0.1", self._port), timeout=2.0, source_address=(STRANGER, 0)
            )
        return self._socket

    def _drop(self) -> None:
        sock, self._socket = self._socket, None
        if sock:
            with contextlib.suppress(OSError):
                sock.close()

    def close(self) -> None:
        self._drop()
