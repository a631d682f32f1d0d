"""A CANopen slave of no maker: it does what its object dictionary says, PDOs included (CiA 301 §7.2.2)."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence

from bridge.canopen.frame import Frame
from tests.support.quick import OPERATIONAL, QuickNode

_OFF = 1 << 31
_BASES = {"rpdo": (0x1400, 0x1600), "tpdo": (0x1800, 0x1A00)}


class PdoNode(QuickNode):
    """Objects are bytes by (index, sub). RPDOs write the objects that they map, TPDOs go out when what
    they map changes and when their event timer runs out, while the node is operational.

    ``react`` is called after an RPDO has come: what the device makes of its objects.
    """

    def __init__(self, node_id: int, react: Callable[[PdoNode], None] = lambda node: None) -> None:
        super().__init__(node_id)
        self._react = react
        self._sent: dict[int, tuple[bytes, float]] = {}

    def put(self, name: str, size: int, value: int) -> None:
        """The object called ``"6041:00"`` holds this number."""
        index, sub = name.split(":")
        data = (value & (1 << 8 * size) - 1).to_bytes(size, "little")
        self.objects[int(index, 16), int(sub, 16)] = data

    def number(self, name: str, *, signed: bool = False) -> int:
        index, sub = name.split(":")
        return int.from_bytes(self.objects[int(index, 16), int(sub, 16)], "little", signed=signed)

    def pdo(
        self,
        kind: str,
        number: int,
        cob_id: int,
        objects: Sequence[str],
        *,
        event_ms: int = 0,
        on: bool = True,
    ) -> None:
        """Set up a PDO; ``objects`` are such as ``"6041:00/16"``, ``cob_id`` is without the node id."""
        parameter, mapping = (base + number - 1 for base in _BASES[kind])
        self.put(f"{parameter:04X}:01", 4, cob_id + self.node_id | (0 if on else _OFF))
        self.put(f"{parameter:04X}:02", 1, 255)
        if kind == "tpdo":
            self.put(f"{parameter:04X}:05", 2, event_ms)
        self.put(f"{mapping:04X}:00", 1, len(objects))
        for place, text in enumerate(objects, 1):
            ref, bits = text.split("/")
            index, sub = ref.split(":")
            self.put(f"{mapping:04X}:{place:02X}", 4, int(index, 16) << 16 | int(sub, 16) << 8 | int(bits))
            self.objects.setdefault((int(index, 16), int(sub, 16)), bytes(int(bits) // 8))

    def emcy(self, data: bytes) -> None:
        self.outbox.append(Frame(0x80 + self.node_id, data))

    def on_frame(self, frame: Frame, now: float) -> None:
        before = self.state
        super().on_frame(frame, now)
        if self.state != before:
            self._sent.clear()
        if self.state != OPERATIONAL:
            return
        for parameter, mapping in self._pdos("rpdo"):
            if self._cob_id(parameter) == frame.can_id:
                self._take(mapping, frame.data)
                self._react(self)
        self._send_due(now)

    def on_time(self, now: float) -> None:
        super().on_time(now)
        if self.state == OPERATIONAL:
            self._send_due(now)

    def next_deadline(self) -> float | None:
        times = [self.heartbeat_at]
        for parameter, _ in self._pdos("tpdo") if self.state == OPERATIONAL else []:
            event_s = self._event_s(parameter)
            if event_s and parameter in self._sent:
                times.append(self._sent[parameter][1] + event_s)
        earliest = min(times)
        return None if earliest == float("inf") else earliest

    def take_frames(self) -> list[Frame]:
        frames, self.outbox = self.outbox, []
        return frames

    def _pdos(self, kind: str) -> list[tuple[int, int]]:
        """Communication and mapping object of each that is on."""
        first, mapping = _BASES[kind]
        found = [index for index, sub in self.objects if sub == 1 and first <= index < first + 0x200]
        return [(index, index - first + mapping) for index in sorted(found) if self._cob_id(index)]

    def _cob_id(self, parameter: int) -> int:
        value = int.from_bytes(self.objects[parameter, 1], "little")
        return 0 if value & _OFF else value & 0x7FF

    def _event_s(self, parameter: int) -> float:
        return int.from_bytes(self.objects.get((parameter, 5), b""), "little") / 1000

    def _mapped(self, mapping: int) -> list[tuple[int, int, int]]:
        count = self.objects[mapping, 0][0]
        words = [struct.unpack("<I", self.objects[mapping, place])[0] for place in range(1, count + 1)]
        return [(word >> 16, word >> 8 & 0xFF, (word & 0xFF) // 8) for word in words]

    def _take(self, mapping: int, data: bytes) -> None:
        for index, sub, size in self._mapped(mapping):
            self.objects[index, sub], data = data[:size], data[size:]

    def _send_due(self, now: float) -> None:
        for parameter, mapping in self._pdos("tpdo"):
            data = b"".join(self.objects[index, sub] for index, sub, _ in self._mapped(mapping))
            last, at = self._sent.get(parameter, (None, now))
            event_s = self._event_s(parameter)
            if data != last or (event_s and now >= at + event_s):
                self._sent[parameter] = (data, now)
                self.outbox.append(Frame(self._cob_id(parameter), data))
