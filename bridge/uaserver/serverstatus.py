"""Status and service level of the server, as clients see them (OPC 10000-5 §6.3.1, OPC 10000-4 §6.6.2.4)."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from copy import copy
from datetime import UTC, datetime, timedelta
from typing import Any, Final

from asyncua.server.address_space import AddressSpace

from bridge.uaserver.library import (
    AttributeIds,
    ObjectIds,
    change,
    data_value,
    get,
    node_id,
    ua,
    variant,
)

HEALTHY: Final = 255
NO_DATA: Final = 1
"""There is nothing but what the server knows of itself."""
MAINTENANCE: Final = 0
"""Clients are to go, and to come back at EstimatedReturnTime."""

UNKNOWN_TIME: Final = datetime(1601, 1, 1, tzinfo=UTC)
"""The DateTime that says that a time is not known (Part 6 §5.2.2.5)."""
_LOOK_S: Final = 0.1
_Type = ua.VariantType


class ServerStatus:
    """The status in the nodes of ``space``, where ``describe`` has put what is there from the start."""

    def __init__(self, space: AddressSpace) -> None:
        self._space = space
        self._level = HEALTHY
        self._is_ending = False

    @property
    def is_ending(self) -> bool:
        return self._is_ending

    async def set_level(self, level: int) -> None:
        """Show another service level. An end that is announced stays so."""
        if self._is_ending or level == self._level:
            return
        self._level = level
        await self._write("Server_ServiceLevel", level, _Type.Byte)

    async def announce_end(
        self,
        notice_s: float,
        reason: ua.LocalizedText,
        has_clients: Callable[[], bool],
        return_after_s: float | None = None,
    ) -> None:
        """Tell clients that the server ends in ``notice_s`` seconds, and return when they are over, or as
        soon as no client is there. ``return_after_s`` is how long after that it is expected back."""
        now = asyncio.get_running_loop().time
        ends_at = now() + notice_s
        back_at = UNKNOWN_TIME
        if return_after_s is not None:
            back_at = datetime.now(UTC) + timedelta(seconds=notice_s + return_after_s)
        await self._write("Server_EstimatedReturnTime", back_at, _Type.DateTime)
        # Last: who sees the level looks at the others.
        await self._tell_end(math.ceil(notice_s), reason)
        await self.set_level(MAINTENANCE)
        self._is_ending = True
        shown = math.ceil(notice_s)
        while (left_s := ends_at - now()) > 0 and has_clients():
            await asyncio.sleep(min(_LOOK_S, left_s))
            left = max(0, math.ceil(ends_at - now()))
            if left != shown:
                shown = left
                await self._tell_end(left, reason)

    async def _tell_end(self, seconds: int, reason: ua.LocalizedText) -> None:
        state = ua.ServerState.Shutdown
        await self._write("Server_ServerStatus_ShutdownReason", reason, _Type.LocalizedText)
        await self._write("Server_ServerStatus_SecondsTillShutdown", seconds, _Type.UInt32)
        await self._write("Server_ServerStatus_State", state, _Type.Int32)
        held = self._space.read_attribute_value(node_id(ObjectIds.Server_ServerStatus), AttributeIds.Value)
        fields = {"State": state, "SecondsTillShutdown": seconds, "ShutdownReason": reason}
        status = change(copy(get(held.Value, "Value")), **fields)
        await self._write("Server_ServerStatus", status, _Type.ExtensionObject)

    async def _write(self, name: str, value: Any, kind: ua.VariantType) -> None:
        now = datetime.now(UTC)
        told = data_value(variant(value, kind), None, now, now)
        await self._space.write_attribute_value(node_id(get(ObjectIds, name)), AttributeIds.Value, told)
