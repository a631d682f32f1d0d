"""CAN: what nodes may say, and what they must not, on the identifiers of the spare nodes and of nobody.

The node of the good clients' drives is left alone, and so is what commands nodes by itself: an NMT command,
an RPDO or a request of LSS would do its work on the simulated drives, whatever the bridge makes of it.
"""

from __future__ import annotations

import contextlib
import socket
import struct
import threading
import time
from random import Random
from typing import Final

from tests.fuzz.case import Case, load
from tests.fuzz.mutate import Mutator
from tests.fuzz.rig import GOOD_NODE, SPARE_NODES, Rig

FRAME: Final = struct.Struct(">I")
_REMOTE: Final = 0x4000_0000
_EXTENDED: Final = 0x8000_0000
_NODE_FUNCTIONS: Final = (0x080, 0x180, 0x280, 0x380, 0x480, 0x580, 0x700)
"""EMCY, TPDO1 … 4, SDO answers, error control: CiA 301 §7.3.5."""
_OF_NOBODY: Final = (0x080, 0x100, 0x7E4, 0x6E0, 0x7FF, 0x001)
"""SYNC, TIME, an answer of LSS, and identifiers without a meaning."""
_STRANGERS: Final = (1, 63, 64, 126)
_WRITE: Final = struct.Struct(">HHHBBHHBHH")
_PLC, _UNIT, _SETPOINT, _CYCLE_S = "127.0.0.8", 8, 0x0800, 0.05
_WORDS: Final = (0x047E, 0x04FE, 0x047E, *(0x047F,) * 20)
_PAUSE_S: Final = 0.01
"""Between two cases: about what a bus of 250 kbit/s carries."""


class Thrower:
    """Sends datagrams to the virtual wire. Meanwhile the spare drive is commanded, as well as that goes."""

    def __init__(self, rig: Rig, random: Random) -> None:
        self._random = random
        self._mutator = Mutator(random, "little")
        self._cases = load("can").of("frames")
        self._all = [part[FRAME.size :] for case in self._cases for part in case.parts]
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.settimeout(2.0)
        self._wire = str(rig.wire)
        self._owner = StubbornOwner(rig.modbus)

    def case(self) -> Case:
        many = self._random.choice((1, 1, 2, 5, 10))
        return Case("frames", tuple(part for _ in range(many) for part in self._some()))

    def _some(self) -> list[bytes]:
        """Frames of one recorded case, each on a node's own identifier or on another one."""
        node = self._random.choice((*SPARE_NODES, *SPARE_NODES, *_STRANGERS))
        found: list[bytes] = []
        for part in self._random.choice(self._cases).parts:
            can_id, data = FRAME.unpack_from(part)[0], part[FRAME.size :]
            function = can_id & 0x780 if can_id & 0x7F else 0
            if function not in _NODE_FUNCTIONS or self._random.randrange(4) == 0:
                function = self._random.choice(_NODE_FUNCTIONS)
            can_id = function + node
            if self._random.randrange(20) == 0:
                can_id = self._random.choice(_OF_NOBODY)
            if self._random.randrange(30) == 0:
                can_id |= self._random.choice((_REMOTE, _EXTENDED))
            if self._random.randrange(4):
                data = self._mutator.mutate(data, self._all)[:8]
            found.append(FRAME.pack(can_id) + data)
        return found

    def throw(self, case: Case) -> None:
        for part in case.parts:
            # Where nobody takes it any more, the judge knows why.
            with contextlib.suppress(OSError):
                if is_allowed(part):
                    self._socket.sendto(part, self._wire)
        time.sleep(_PAUSE_S * max(1, len(case.parts) // 10))

    def close(self) -> None:
        self._owner.close()
        self._socket.close()


class StubbornOwner:
    """A PLC that leads the spare drive to its run again and again, whatever becomes of it."""

    def __init__(self, port: int) -> None:
        self._port = port
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()

    def _work(self) -> None:
        while not self._stopped.is_set():
            with contextlib.suppress(OSError), self._connected() as sock:
                while not self._stopped.is_set():
                    for word in _WORDS:
                        sock.sendall(_WRITE.pack(1, 0, 11, _UNIT, 16, 0, 2, 4, word, _SETPOINT))
                        if not sock.recv(256):
                            raise ConnectionResetError
                        self._stopped.wait(_CYCLE_S)
            self._stopped.wait(_CYCLE_S)

    def _connected(self) -> socket.socket:
        return socket.create_connection(("127.0.0.1", self._port), timeout=2.0, source_address=(_PLC, 0))

    def close(self) -> None:
        self._stopped.set()
        self._thread.join(5.0)


def is_allowed(part: bytes) -> bool:
    """Whether this frame may be thrown without doing rightfully what the judge forbids."""
    can_id = FRAME.unpack_from(part)[0] & 0x7FF
    return can_id in _OF_NOBODY or (
        can_id & 0x780 in _NODE_FUNCTIONS and can_id & 0x7F not in (0, GOOD_NODE, 127)
    )
