"""Decodes SDO frames (CiA 301 §7.2.4.3) for listeners. Sans-IO.

A segment does not name its object: each channel remembers the object of its transfer.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from bridge.canopen import abort
from bridge.canopen.sdo_transfer import ABORT, MUX, U32, expedited, segment

_MOST_COLLECTED: Final = 4096
"""Bytes of one value that are kept: a monitor runs for days beside clients of any kind."""
_PRINTABLE: Final = range(0x20, 0x7F)

Value = int | str


@dataclass(frozen=True, slots=True)
class SdoSaid:
    """One SDO frame. ``values`` are its facts by name, for scripts. Of a request, ``act`` is what it does
    and ``number`` the bytes, the segment or the command that it is about."""

    text: str
    values: tuple[tuple[str, Value], ...] = ()
    act: str = ""
    number: int | None = None


@dataclass(slots=True)
class SdoListener:
    """One channel: its requests and its answers, in the order of the wire."""

    _index: int = 0
    _sub: int = 0
    _data: bytearray = field(default_factory=bytearray)
    _block: str = ""
    """"down" or "up" while frames of that direction are bare segments."""
    _sequence: int = 0
    _is_last: bool = False

    @property
    def _object(self) -> str:
        return f"{self._index:04X}h:{self._sub:02X}"

    def request(self, data: bytes) -> SdoSaid:
        """A frame from client to server."""
        if len(data) != 8:
            return SdoSaid(f"SDO request of {len(data)} bytes", act="length", number=len(data))
        command = data[0]
        if command == ABORT:
            return self._abort(data, "client")
        if self._block == "down":
            return self._block_segment(data)
        match command >> 5:
            case 0:
                return self._segment(data, "write")
            case 1:
                return self._initiate_download(data)
            case 2:
                self._begin(data)
                return self._about("read", f"read {self._object}", act="read")
            case 3:
                return self._about("read", f"read {self._object}: next segment", act="read_on")
            case 5:
                return self._block_upload_request(data)
            case 6:
                if command & 1:
                    return self._about("write", f"block write {self._object}: end", act="block_write_end")
                self._begin(data)
                return self._about("write", f"block write {self._object}", act="block_write")
            case _:
                return SdoSaid(
                    f"SDO request with unknown command {command:02X}h", act="unknown", number=command
                )

    def reply(self, data: bytes) -> SdoSaid:
        """A frame from server to client."""
        if len(data) != 8:
            return SdoSaid(f"SDO answer of {len(data)} bytes")
        command = data[0]
        if command == ABORT:
            return self._abort(data, "node")
        if self._block == "up":
            return self._block_segment(data)
        match command >> 5:
            case 0:
                return self._segment(data, "read")
            case 1:
                return self._about("write", f"{self._object}: segment taken")
            case 2:
                return self._initiate_upload(data)
            case 3:
                self._name(data)
                return self._about("write", f"{self._object} written")
            case 5:
                return self._block_download_reply(data)
            case 6:
                if command & 1:
                    return self._about("read", f"block read {self._object}: end")
                self._name(data)
                return self._about("read", f"block read {self._object}: {_size(data, command & 2)}")
            case _:
                return SdoSaid(f"SDO answer with unknown command {command:02X}h")

    def _name(self, data: bytes) -> None:
        self._index, self._sub = MUX.unpack_from(data, 1)

    def _begin(self, data: bytes) -> None:
        self._name(data)
        self._data.clear()
        self._block = ""

    def _about(
        self, what: str, text: str, *more: tuple[str, Value], act: str = "", number: int | None = None
    ) -> SdoSaid:
        head = (("operation", what), ("index", f"{self._index:04X}"), ("sub", self._sub))
        return SdoSaid(text, (*head, *more), act, number)

    def _abort(self, data: bytes, who: str) -> SdoSaid:
        self._name(data)
        self._block = ""
        code = U32.unpack_from(data, 4)[0]
        text = f"{self._object}: the {who} aborts: {abort.text(code)} ({code:08X}h)"
        facts = ("abort_code", f"{code:08X}"), ("abort_text", abort.text(code))
        return self._about("abort", text, *facts, act="abort", number=code)

    def _initiate_download(self, data: bytes) -> SdoSaid:
        self._begin(data)
        if data[0] & 2:
            value = expedited(data)
            text = f"write {self._object} := {shown(value)}"
            return self._about("write", text, ("data", value.hex()), act="write")
        text = f"write {self._object}: {_size(data, data[0] & 1)} in segments"
        return self._about("write", text, act="write_long", number=_count(data) if data[0] & 1 else None)

    def _initiate_upload(self, data: bytes) -> SdoSaid:
        self._begin(data)
        if data[0] & 2:
            value = expedited(data)
            return self._about("read", f"{self._object} = {shown(value)}", ("data", value.hex()))
        return self._about("read", f"{self._object}: {_size(data, data[0] & 1)} in segments")

    def _segment(self, data: bytes, what: str) -> SdoSaid:
        self._collect(segment(data))
        if not data[0] & 1:
            return self._about(what, f"{self._object}: segment", act="segment")
        value = bytes(self._data)
        sign = ":=" if what == "write" else "="
        return self._about(what, f"{self._object} {sign} {shown(value)}", ("data", value.hex()), act="value")

    def _collect(self, part: bytes) -> None:
        if len(self._data) + len(part) <= _MOST_COLLECTED:
            self._data += part

    def _block_segment(self, data: bytes) -> SdoSaid:
        self._sequence, self._is_last = data[0] & 0x7F, bool(data[0] & 0x80)
        last = ", the last" if self._is_last else ""
        what = "write" if self._block == "down" else "read"
        act = "last_block_segment" if self._is_last else "block_segment"
        text = f"{self._object}: block segment {self._sequence}{last}"
        return self._about(what, text, act=act, number=self._sequence)

    def _acknowledged(self, sequence: int) -> None:
        """The receiver has taken segments up to ``sequence``; those after it are sent again."""
        if self._is_last and sequence == self._sequence:
            self._block = ""

    def _block_upload_request(self, data: bytes) -> SdoSaid:
        match data[0] & 3:
            case 0:
                self._begin(data)
                return self._about("read", f"block read {self._object}", act="block_read")
            case 1:
                return self._about("read", f"block read {self._object}: end confirmed", act="block_read_end")
            case 2:
                self._acknowledged(data[1])
                text = f"{self._object}: segments up to {data[1]} taken"
                return self._about("read", text, act="taken", number=data[1])
            case _:
                self._block, self._is_last = "up", False
                return self._about("read", f"block read {self._object}: start", act="block_read_start")

    def _block_download_reply(self, data: bytes) -> SdoSaid:
        match data[0] & 3:
            case 0:
                self._name(data)
                self._block, self._is_last = "down", False
                text = f"block write {self._object}: blocks of {data[4]} segments"
                return self._about("write", text)
            case 2:
                self._acknowledged(data[1])
                return self._about("write", f"{self._object}: segments up to {data[1]} taken")
            case _:
                return self._about("write", f"block write {self._object}: end confirmed")


def _size(data: bytes, is_given: int) -> str:
    return f"{_count(data)} bytes" if is_given else "bytes"


def _count(data: bytes) -> int:
    return U32.unpack_from(data, 4)[0]


def shown(value: bytes) -> str:
    """A value of unknown type: as a number if it has the length of one, else as text or bytes."""
    text = value.rstrip(b"\0")
    readable = f'"{text.decode("ascii")}"' if text and all(c in _PRINTABLE for c in text) else ""
    if len(value) in (1, 2, 4, 8):
        number = int.from_bytes(value, "little")
        also = f", {readable}" if readable and len(text) == 4 else ""
        return f"{number} ({value[::-1].hex().upper()}h{also})"
    return readable or value.hex(" ").upper() or "nothing"
