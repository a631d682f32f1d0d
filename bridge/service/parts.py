"""The parts of the service beside its buses: servers and fronts. One that fails is reported and restarted.

No failure of a part ends the service: clients of the other parts go on moving drives.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Awaitable, Callable, Sequence
from typing import Final, Protocol

from bridge.base.errors import BridgeError, Unavailable
from bridge.base.notify import Notifier
from bridge.base.quietlog import log_source
from bridge.base.ratelimit import Pauses
from bridge.command import Event, EventKind, Plant
from bridge.service.front_process import shortened
from bridge.text import Said, Text, render

_log = logging.getLogger(__name__)

_FIRST_PAUSE_S: Final = 0.2
_LAST_PAUSE_S: Final = 10.0
_STABLE_S: Final = 30.0
"""Time in seconds after which a part that served starts again with the first pause."""
_FAILING: Final = "bridge/fronts_failing"


class Supervised(Protocol):
    """A supervised server or front. ``name`` is that of its point, ``title`` that in sentences."""

    name: str
    title: Text

    async def run_once(self, serves: Callable[[], None]) -> Text:
        """Start it where it has ended, call ``serves`` (once or more) when it can be used, and wait until it
        ends. Returns how, as the end of a sentence. May raise."""
        ...


class Server(Protocol):
    async def start(self) -> None: ...

    async def failed(self) -> None: ...


class Ports:
    """Ports that are opened at the start. One port that is taken, or an address that is not there yet, does
    not keep a plant from being served on the others: it is tried again with the parts."""

    def __init__(self) -> None:
        self._opened: set[str] = set()
        self._failed: dict[str, str] = {}

    async def open(self, name: str, start: Callable[[], Awaitable[object]]) -> None:
        """Open the port of ``name`` and start its server."""
        try:
            await start()
        except Unavailable as error:
            self._failed[name] = str(error)
        else:
            self._opened.add(name)

    def has(self, name: str) -> bool:
        """True if it has been opened."""
        return name in self._opened

    def check(self, *, needs_all: bool) -> None:
        """Raise ``Unavailable`` where none could be opened, or where one could not and the site
        ``needs_all``: a service that cannot be reached must not command a bus."""
        if self._failed and (needs_all or not self._opened):
            raise Unavailable("\n".join(self._failed.values()))


class SupervisedServer:
    """A server of this process, which ``is_started`` already or is to be started first."""

    def __init__(self, name: str, title: Text, server: Server, *, is_started: bool = True) -> None:
        self.name = name
        self.title = title
        self._server = server
        self._is_started = is_started

    async def run_once(self, serves: Callable[[], None]) -> Text:
        if not self._is_started:
            await self._server.start()
        self._is_started = False
        serves()
        await self._server.failed()
        return Text.of("front.has_ended")


class Supervisor:
    """Keeps the parts going, and reports which fail: point, events, and systemd's status line.

    ``clock`` is the plant's; ``status`` is the rest of the status line.
    """

    def __init__(self, plant: Plant, notifier: Notifier, clock: Callable[[], float], status: str) -> None:
        self._plant = plant
        self._notifier = notifier
        self._clock = clock
        self._status = status
        self._failing: dict[str, Text] = {}
        self._pauses = Pauses()
        self._told: set[str] = set()
        self._unknown: set[str] = set()
        self._all_known = asyncio.Event()
        plant.set(_FAILING, "", plant.began)

    @property
    def status(self) -> str:
        """Status line of the service, for systemd."""
        failing = self._failing_said
        return f"{self._status}; not served: {render(failing)}" if failing else self._status

    @property
    def _failing_said(self) -> Said:
        """Empty where all serve."""
        parts = tuple(
            Text.of("front.fails", front=name, how=self._failing[name]) for name in sorted(self._failing)
        )
        return Text.of("front.failing", parts=parts) if parts else ""

    def expect(self, parts: Sequence[Supervised]) -> None:
        """Set the parts that must have served or failed before ``all_known`` returns."""
        self._unknown = {part.name for part in parts}
        self._look()

    async def all_known(self) -> None:
        """Wait until each part has served or failed for the first time."""
        await self._all_known.wait()

    async def keep(self, part: Supervised) -> None:
        """Keep ``part`` going until cancelled; restart it after each end, with growing pauses."""
        pause_s = _FIRST_PAUSE_S
        while True:
            began = time.monotonic()
            how = await self._run_once(part)
            if time.monotonic() - began > _STABLE_S:
                pause_s = _FIRST_PAUSE_S
            self._fails(part, how, pause_s)
            await asyncio.sleep(pause_s)
            pause_s = min(pause_s * 2, _LAST_PAUSE_S)

    async def _run_once(self, part: Supervised) -> Text:
        try:
            return await part.run_once(lambda: self._serves(part))
        except (BridgeError, OSError) as error:
            return Text.of("front.has_failed", why=shortened(str(error)))
        except Exception as error:  # noqa: BLE001 - one of them must not stop the drives of the others
            _log.exception("unexpected", extra=log_source(part.name))
            return Text.of("front.has_failed", why=shortened(repr(error)))

    def _fails(self, part: Supervised, how: Text, pause_s: float) -> None:
        """Report a failure, at most once a minute: a part that never comes up must not fill a disk."""
        self._failing[part.name] = how
        now = self._clock()
        self._settled(part, now)
        if self._pauses.take(now, part.name) is not None:
            self._told.add(part.name)
            what = Text.of("front.what", front=part.title, how=how)
            said = Text.of("front.ended", what=what, pause_s=pause_s)
            self._plant.report(Event(now, EventKind.FRONT, "bridge", 700, said))

    def _serves(self, part: Supervised) -> None:
        if part.name not in self._failing and part.name not in self._unknown:
            return
        self._failing.pop(part.name, None)
        now = self._clock()
        self._settled(part, now)
        if part.name in self._told:
            self._told.discard(part.name)
            said = Text.of("front.serves_again", part=part.title)
            self._plant.report(Event(now, EventKind.FRONT, "bridge", 200, said))

    def _settled(self, part: Supervised, now: float) -> None:
        self._unknown.discard(part.name)
        self._look()
        image = self._plant.image
        image.say(image.index[_FAILING], self._failing_said, now)
        self._notifier.status(self.status)

    def _look(self) -> None:
        if not self._unknown:
            self._all_known.set()
