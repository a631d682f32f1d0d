"""The messages of one connection that wait to be processed."""

# asyncua's buffers have no types:
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

from asyncua.common.utils import Buffer


class Inbox(asyncio.Queue[tuple[Any, Any]]):
    """Headers and bodies. Full also where all bodies together are ``most_bytes`` or more.

    Each has a buffer of its own: asyncua's keep, with each message, all that was read after it.
    """

    def __init__(self, most: int, most_bytes: Callable[[], int]) -> None:
        super().__init__(most)
        self.held_bytes = 0
        self._most_bytes = most_bytes

    def full(self) -> bool:
        return super().full() or self.held_bytes >= self._most_bytes()

    def _put(self, item: tuple[Any, Any]) -> None:
        header, body = item
        # Without a header it says that the connection has ended.
        if header is not None:
            body = Buffer(body.read(header.body_size))
            self.held_bytes += header.body_size
        super()._put((header, body))

    def _get(self) -> tuple[Any, Any]:
        header, body = super()._get()
        if header is not None:
            self.held_bytes -= header.body_size
        return header, body
