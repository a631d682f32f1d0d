"""Emergency messages (CiA 301 §7.2.7)."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Final

_HEAD: Final = struct.Struct("<HB")


@dataclass(frozen=True, slots=True)
class Emergency:
    """``vendor`` is the manufacturer's five bytes (fewer if the node sent a short message)."""

    code: int
    register: int
    vendor: bytes


def decode(data: bytes) -> Emergency | None:
    """The emergency in ``data``, or None if it is too short for a code and a register."""
    if len(data) < _HEAD.size:
        return None
    code, register = _HEAD.unpack_from(data)
    return Emergency(code, register, data[3:])
