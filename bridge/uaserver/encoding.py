"""The results of a service on the wire: no larger than the client takes them, and encoded in turns.

Encoding takes longer than finding what is encoded: a hundred thousand references in one go hold up
everybody.
"""

# asyncua's encoder has no types:
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false

from __future__ import annotations

import asyncio
import struct
from typing import Any, Final

from asyncua.ua.ua_binary import struct_to_binary

from bridge.uaserver.library import ServiceError, StatusCodes, UaError, ua

UNSENDABLE: Final = (UaError, ValueError, TypeError, AttributeError, struct.error)
"""Exceptions of asyncua's encoder for a value that is not of its type."""

_TURN_BYTES: Final = 16 * 1024
"""Bytes that are encoded before others have their turn; a few milliseconds."""
_EACH_BYTES: Final = 32
"""Bytes that one value or result counts besides its own: small ones take their time, too."""
_LENGTH: Final = struct.Struct("<i")


class Results:
    """Results of a service so far, each encoded as it is added."""

    def __init__(self, most_bytes: int) -> None:
        self.count = 0
        self.encoded = bytearray()
        self.most_bytes = most_bytes
        self._turn_at = _TURN_BYTES

    async def add(self, result: object) -> None:
        """Raises ServiceError where all of them are more than the client takes."""
        self.encoded += struct_to_binary(result)
        if len(self.encoded) > self.most_bytes:
            raise ServiceError(StatusCodes.BadResponseTooLarge)
        self.count += 1
        done = len(self.encoded) + _EACH_BYTES * self.count
        if done >= self._turn_at:
            self._turn_at = done + _TURN_BYTES
            await asyncio.sleep(0)


def encode(response: Any) -> bytes:
    """A response. One with ``Results``, its own or its parameters', has nothing behind them but its
    DiagnosticInfos."""
    holder = getattr(response, "Parameters", response)
    results = getattr(holder, "Results", None)
    if not isinstance(results, Results):
        return struct_to_binary(response)
    infos, holder.Results, holder.DiagnosticInfos = holder.DiagnosticInfos, [], []
    head = struct_to_binary(response)[: -2 * _LENGTH.size]
    told = (_LENGTH.pack(len(infos)), *map(struct_to_binary, infos))
    return b"".join((head, _LENGTH.pack(results.count), results.encoded, *told))


def weight(value: Any) -> int:
    """Bytes that a value takes with its status and its times, about; nothing is encoded for it."""
    if isinstance(value, ua.Variant):
        return weight(value.Value)
    if isinstance(value, ua.LocalizedText):
        return weight(value.Text)
    if isinstance(value, str | bytes):
        return _EACH_BYTES + len(value)
    if isinstance(value, list | tuple):
        return _EACH_BYTES + sum(map(weight, value))
    return _EACH_BYTES
