"""A configuration to be downloaded to a node: from the site file, or a concise DCF (CiA 302-3)."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from typing import Final

from bridge.canopen.sdo import COMMANDS
from bridge.text import Text
from bridge.tomlfile import Unfit

_HEAD: Final = struct.Struct("<HBI")
_COUNT: Final = struct.Struct("<I")


@dataclass(frozen=True, slots=True)
class Download:
    """One object and its bytes as they go over the wire.

    With ``read_back`` it is compared first, written where it differs and read back; without, it is written
    blindly, as a command is. ``kind`` is the data type, empty where that is not known.
    """

    index: int
    sub: int
    data: bytes
    read_back: bool = True
    kind: str = field(default="", compare=False)

    @property
    def is_command(self) -> bool:
        """Store or restore: these never read back what was written (CiA 301 §7.5.2.13–14)."""
        return self.index in COMMANDS

    @property
    def name(self) -> str:
        return f"{self.index:04X}h:{self.sub:02X}"


def parse_concise_dcf(content: bytes) -> tuple[Download, ...]:
    """The objects of a concise DCF, 1F22h (CiA 302-3): count, then index, sub-index, size, data.

    Raises Unfit that names the entry where the stream is cut or says something impossible.
    """
    if len(content) < _COUNT.size:
        raise Unfit(Text.of("download.short"))
    count = _COUNT.unpack_from(content)[0]
    place = _COUNT.size
    found: list[Download] = []
    for entry in range(1, count + 1):
        if place + _HEAD.size > len(content):
            raise Unfit(Text.of("download.cut", entry=entry, count=count))
        index, sub, size = _HEAD.unpack_from(content, place)
        place += _HEAD.size
        if not size or place + size > len(content):
            said = Text.of("download.size", entry=entry, index=index, sub=sub, size=size)
            raise Unfit(said)
        found.append(Download(index, sub, content[place : place + size], index not in COMMANDS))
        place += size
    if place != len(content):
        raise Unfit(Text.of("download.surplus", surplus=len(content) - place, count=count))
    return tuple(found)


def to_concise_dcf(downloads: tuple[Download, ...]) -> bytes:
    """``downloads`` as a concise DCF, 1F22h."""
    parts = [_COUNT.pack(len(downloads))]
    for one in downloads:
        parts += [_HEAD.pack(one.index, one.sub, len(one.data)), one.data]
    return b"".join(parts)
