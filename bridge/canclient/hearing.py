"""The frames of a bus, heard beside the bridge in a thread of their own."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from typing import Final

from bridge.can.listener import Listener, listener_of
from bridge.canopen.frame import Frame

_LOOK_S: Final = 0.01
_OPENS_S: Final = 10.0
_SOCKETCAN: Final = "socketcan"


class Hearing:
    """Hands each frame to ``heard``, and the reason to ``ended`` where no more will come.

    ``place`` is what the gateway says: ``socketcan <interface>``, or ``tap <path>`` of the socket at which
    the bus process passes its frames on. Raises OSError where nothing can be heard there.
    """

    def __init__(self, place: str, heard: Callable[[Frame], None], ended: Callable[[str], None]) -> None:
        kind, _, where = place.partition(" ")
        self._listener = listener_of(kind, where if kind == _SOCKETCAN else "", Path(where))
        self._heard = heard
        self._ended = ended
        self._is_over = threading.Event()
        opened = Future[None]()
        self._thread = threading.Thread(
            target=lambda: asyncio.run(self._hear(self._listener, opened)), name="drivebridge", daemon=True
        )
        self._thread.start()
        opened.result(_OPENS_S)

    async def _hear(self, listener: Listener, opened: Future[None]) -> None:
        try:
            listener.open()
        except OSError as error:
            opened.set_exception(error)
            return
        opened.set_result(None)
        try:
            while not self._is_over.is_set() and not listener.failure:
                await asyncio.sleep(_LOOK_S)
                for frame in listener.take():
                    self._heard(frame)
        finally:
            listener.close()
        if listener.failure:
            self._ended(str(listener.failure))

    def close(self) -> None:
        self._is_over.set()
        self._thread.join(_OPENS_S)
