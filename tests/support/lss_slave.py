"""An LSS slave after CiA 305. It shares no code with our master, but an author; what keeps both honest is
canopen's own LSS master, which is run against it (``tests/unit/canopen/test_lss_foreign.py``)."""

from __future__ import annotations

from dataclasses import dataclass, field

WAITING, CONFIGURATION = 0, 1


@dataclass(slots=True)
class LssSlave:
    """One device. ``on_request`` takes the eight bytes on 7E5h and gives those on 7E4h, or None."""

    identity: tuple[int, int, int, int]
    node_id: int = 255
    pending_id: int = 255
    state: int = WAITING
    stored: tuple[int, int] | None = None
    bit_timing: int = 0
    activated_ms: int | None = None
    cannot_store: bool = False
    talks_when_found: bool = False
    """Behaviour of CANopenNode 4: in configuration state every question of a fastscan is answered, and every
    switch state selective is taken for its own."""
    never_leaves: bool = False
    """The last confirmation of a fastscan does not lead to configuration state."""
    answers_all: bool = False
    """Every question of a fastscan is answered, in every state."""
    log: list[bytes] = field(default_factory=list[bytes])
    _selected: list[int] = field(default_factory=list[int])
    _scan_part: int = 0

    def __post_init__(self) -> None:
        self.pending_id = self.node_id

    def on_request(self, data: bytes) -> bytes | None:
        self.log.append(data)
        command = data[0]
        number = int.from_bytes(data[1:5], "little")
        if command == 0x04:
            self._switch(data[1])
            return None
        if 0x40 <= command <= 0x43:
            return self._select(command - 0x40, number)
        if command == 0x51:
            return self._fastscan(number, data[5], data[6], data[7])
        if self.state != CONFIGURATION:
            return None
        return self._configure(command, data)

    def _switch(self, state: int) -> None:
        self.state = state
        if state == WAITING:
            # A device that had no node id starts with the one it was given; another one needs a reset.
            if self.node_id == 255:
                self.node_id = self.pending_id
            self._scan_part = 0

    def _select(self, part: int, number: int) -> bytes | None:
        if part == 0:
            self._selected = []
        self._selected.append(number)
        if self.talks_when_found and self.state == CONFIGURATION:
            return b"\x44" + bytes(7) if part == 3 else None
        if part == 3 and tuple(self._selected) == self.identity:
            self.state = CONFIGURATION
            return b"\x44" + bytes(7)
        return None

    def _fastscan(self, number: int, bit: int, part: int, following: int) -> bytes | None:
        if self.answers_all or (self.talks_when_found and self.state == CONFIGURATION):
            return b"\x4f" + bytes(7)
        if self.state != WAITING or self.node_id != 255 or self.pending_id != 255:
            return None
        if bit == 0x80:
            self._scan_part = 0
            return b"\x4f" + bytes(7)
        if part != self._scan_part or (self.identity[part] ^ number) >> bit:
            return None
        if bit == 0:
            self._scan_part = following
            # The last confirmation: the one device that is left is now the one that is talked to.
            if part == 3 and following == 0 and not self.never_leaves:
                self.state = CONFIGURATION
        return b"\x4f" + bytes(7)

    def _configure(self, command: int, data: bytes) -> bytes | None:
        if command == 0x11:
            is_good = 1 <= data[1] <= 127 or data[1] == 255
            if is_good:
                self.pending_id = data[1]
            return bytes((0x11, not is_good)) + bytes(6)
        if command == 0x13:
            is_good = data[1] == 0 and data[2] in (0, 2, 3, 4, 9)
            if is_good:
                self.bit_timing = data[2]
            return bytes((0x13, not is_good)) + bytes(6)
        if command == 0x15:
            self.activated_ms = int.from_bytes(data[1:3], "little")
            return None
        if command == 0x17:
            if self.cannot_store:
                return b"\x17\x01" + bytes(6)
            self.stored = (self.pending_id, self.bit_timing)
            return b"\x17" + bytes(7)
        if 0x5A <= command <= 0x5D:
            return bytes((command,)) + self.identity[command - 0x5A].to_bytes(4, "little") + bytes(3)
        if command == 0x5E:
            return bytes((0x5E, self.node_id)) + bytes(6)
        return None
