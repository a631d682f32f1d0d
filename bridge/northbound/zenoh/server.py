"""The zenoh server: values and events out, gets and commands in.

With users, the command key tells who the controller is (``users.py``). Without them it is who it says it is
in the query's attachment, and anybody who reaches the port may command: that is why the server listens on
loopback by default.
"""

from __future__ import annotations

import asyncio
import logging
import re
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from typing import Final

import zenoh

from bridge.base.errors import Unavailable
from bridge.base.quietlog import log_source
from bridge.base.sources import source_of
from bridge.command import Code, Event, Identity, Outcome, Rejection, Reply, Request, Source
from bridge.command.messages.request import STOP_ACTIONS
from bridge.config import ZenohTable
from bridge.image import Quality, Reading
from bridge.northbound.pulse import Pulse
from bridge.northbound.view import View
from bridge.northbound.zenoh import keys
from bridge.northbound.zenoh.access_control import access_control
from bridge.northbound.zenoh.askers import Askers
from bridge.northbound.zenoh.commands import MALFORMED, BadCommand, Commands, identity_of, session_of
from bridge.northbound.zenoh.controller_sessions import ControllerSessions
from bridge.northbound.zenoh.gets import Gets
from bridge.northbound.zenoh.publication import Publication
from bridge.northbound.zenoh.users import ANONYMOUS, Users, read_users
from bridge.text import Text
from bridge.zenohlink import IncomingQuery, Sample, ZenohLink, zenoh_config

_log = logging.getLogger(__name__)

_REPLIES_AT_ONCE: Final = 200
_LONGEST: Final = 8192
"""Bytes of a message with all that is in it: twice the longest command."""


class ZenohServer:
    """Serves one site under zenoh keys. ``clock`` is the machine's monotonic clock in seconds."""

    def __init__(self, view: View, settings: ZenohTable, site_name: str, clock: Callable[[], float]) -> None:
        self._view = view
        self._image = view.image
        self._settings = settings
        self._clock = clock
        self._keys = keys.KeySpace(settings.prefix, site_name, self._image.points)
        self._commands = Commands(self._image.points)
        self._users = read_users(settings)
        self._link = self._new_link()
        self._pulse = Pulse(clock)
        self._askers = Askers()
        self._sessions = ControllerSessions()
        self._publication = self._new_publication()
        self._gets = Gets[asyncio.Task[None]]()
        self._was_started = False

    def _new_link(self) -> ZenohLink:
        config = _config(self._settings, self._keys, self._users)
        encoding = keys.JSON if self._settings.encoding == "json" else keys.TEXT
        return ZenohLink(config, "zenoh", self._keys.is_prompt, self._on_strangers, encoding)

    def _new_publication(self) -> Publication:
        return Publication(self._view, self._keys, self._settings, self._link)

    async def start(self) -> None:
        """Open the session, also again after ``failed``. Raises Unavailable where zenoh cannot listen."""
        if self._was_started:
            await self._start_anew()
        self._was_started = True
        try:
            if not await self._link.open():
                _log.warning("zenoh: nobody answers at %s yet", ", ".join(self._settings.connect))
        except Unavailable as error:
            listen = ", ".join(self._settings.listen)
            raise Unavailable(f"{error} (is another bridge running? [zenoh] listen = {listen})") from None
        self._pulse.start()
        space, share = self._keys, self._keys.share
        self._link.declare_queryable(space.everything, self._on_query, share)
        if self._settings.accept_put:
            self._link.declare_subscriber(space.commands, self._on_put, share, from_others=True)
        if self._users.are_proved:
            self._link.declare_queryable(space.controllers, self._on_query, share)
            if self._settings.accept_put:
                self._link.declare_subscriber(space.own_commands, self._on_put, share, from_others=True)
        self._link.follow_endings(self._on_ending)
        self._view.on_event(self._on_event)
        self._publication.start()

    async def _start_anew(self) -> None:
        """Start with a new session that knows nothing of the one before."""
        await self.close()
        self._users = read_users(self._settings)
        self._link = self._new_link()
        self._publication = self._new_publication()

    async def close(self) -> None:
        self._pulse.stop()
        for task in self._gets.all:
            task.cancel()
        self._view.forget(self._on_event)
        self._publication.stop()
        await self._link.close()

    async def failed(self) -> None:
        """Wait until closed, or raise ``OperationFailed`` when the link has ended by itself."""
        await self._link.failed()

    # out

    def _render(self, index: int, at_zero_ns: int) -> Sample:
        """``at_zero_ns``: the wall clock at time 0, which is read once for many points."""
        reading = self._image[index]
        return self._message(self._keys.keys[index], index, reading, at_zero_ns + round(reading.time * 1e9))

    def _message(self, key: str, index: int | None, reading: Reading, epoch_ns: int) -> Sample:
        if self._settings.encoding == "json":
            return Sample(key, self._keys.as_json(index, reading, epoch_ns), keys.JSON)
        value, attachment = self._keys.as_bare(index, reading, epoch_ns)
        return Sample(key, value, keys.TEXT, attachment)

    def _on_event(self, event: Event) -> None:
        payload = keys.event_json(event, self._view.epoch_ns(event.time))
        self._link.send(Sample(self._keys.event_key(event), payload, keys.JSON))

    def _on_ending(self, source: str) -> None:
        """The connection to the zenoh session ``source`` has ended."""
        self._view.count("zenoh_broken_connections")
        for identity, has_others in self._sessions.ended(source):
            self._view.on_connection(identity, is_there=False, has_others=has_others)

    def _on_strangers(self, places: list[str]) -> None:
        """Clients that stayed silent, or that zenoh does not let in."""
        self._view.count("zenoh_broken_connections", len(places))
        sources = Counter(source_of(place.rpartition(":")[0].strip("[]")) for place in places)
        for source, count in sources.items():
            _log.warning(
                "connections of %s came to no zenoh session: %d", source, count, extra=log_source(source)
            )

    # in

    def _on_query(self, asked: IncomingQuery) -> None:
        is_pattern = "*" in asked.key
        owner, tail = ("", "") if is_pattern else self._users.owner(self._keys.tail(asked.key))
        if is_pattern and asked.payload is not None:
            bad = BadCommand(MALFORMED, Text.of("zenoh.one_key"))
            self._note_refusal(owner, asked.key, asked, bad)
            _refuse(asked, bad)
        elif asked.payload is not None or self._commands.is_method(tail):
            self._command(asked, owner, tail)
        elif self._commands.parameter(tail)[1]:
            self._read_parameter(asked, owner, tail)
        elif asked.key in self._keys.index:
            asked.send([self._render(self._keys.index[asked.key], self._view.epoch_ns(0.0))])
            asked.finish()
        elif not is_pattern:
            _refuse(asked, BadCommand(Code.UNKNOWN_POINT, Text.of("zenoh.nothing", key=tail)))
        elif self._keys.is_prompt(asked.key):
            # At once: so few that they fit into the queue to their reader.
            asked.send(self._matching(self._keys.of_owner(asked.key), asked.key))
            asked.finish()
        elif not self._gets.has_room(asked.source, self._clock()):
            _refuse(asked, BadCommand("busy", Text.of("zenoh.too_many_gets")))
        else:
            task = asyncio.get_running_loop().create_task(self._answer_get(asked.apart()))
            ending = self._gets.add(task, asked.source, self._clock())
            if ending:
                ending.cancel()
            task.add_done_callback(self._gets.done)

    async def _answer_get(self, asked: IncomingQuery) -> None:
        """The present values of all points that match, a portion at a time."""
        # A part of the answer must not look like all of it.
        end = partial(_refuse, asked, BadCommand("busy", Text.of("zenoh.read_slowly")))
        try:
            for start in range(0, len(self._keys.keys), _REPLIES_AT_ONCE):
                portion = range(start, min(start + _REPLIES_AT_ONCE, len(self._keys.keys)))
                if messages := self._matching(portion, asked.key):
                    asked.send(messages)
                await asked.settle()
            end = asked.finish
        finally:
            end()

    def _matching(self, indices: Iterable[int], pattern: str) -> list[Sample]:
        """The present values of those points whose keys match."""
        wanted, all_keys, at_zero_ns = zenoh.KeyExpr(pattern), self._keys.keys, self._view.epoch_ns(0.0)
        return [self._render(index, at_zero_ns) for index in indices if wanted.intersects(all_keys[index])]

    def _command(self, asked: IncomingQuery, owner: str, tail: str) -> None:
        def reply(outcome: Outcome) -> None:
            payload = keys.outcome_json(outcome)
            if outcome.ok:
                asked.send([Sample(asked.key, payload, keys.JSON)])
                asked.finish()
            else:
                asked.fail(payload, keys.JSON)

        try:
            request = self._request(owner, tail, asked.payload or b"", self._identity(owner, asked))
        except BadCommand as bad:
            self._note_refusal(owner, tail, asked, bad)
            _refuse(asked, bad)
            return
        self._submit(request, asked.received_at, reply)

    def _request(self, owner: str, tail: str, payload: bytes, identity: Identity) -> Request:
        """Raises ``BadCommand``. A stop is accepted from anybody."""
        request = self._commands.request(tail, payload, identity)
        if self._users.are_proved and not owner and request.action not in STOP_ACTIONS:
            own = f"{self._keys.top}/@/controller/<user>/{tail}"
            raise BadCommand(Code.NOT_ALLOWED, Text.of("zenoh.shared_key", own=own))
        return request

    def _submit(self, request: Request, received_at: float, reply: Reply) -> None:
        """``received_at``: when zenoh handed it over."""
        now = self._clock()
        came_at = self._askers.arrival(request.identity.user, received_at, now, self._pulse.look)
        self._view.submit(replace(request, received_at=came_at), reply)

    def _identity(self, owner: str, sent: IncomingQuery | Sample) -> Identity:
        """Raises ``BadCommand``."""
        if self._users.are_proved:
            who = owner or ANONYMOUS
            identity = Identity(Source.ZENOH, who, connection=session_of(sent.attachment))
        else:
            identity = identity_of(sent.attachment)
        identity = replace(identity, sets_parameters=self._settings.parameters == "write")
        return self._sessions.of(identity, sent.source)

    def _read_parameter(self, asked: IncomingQuery, owner: str, tail: str) -> None:
        """A get on the key of a parameter: read from the drive, or with ``?cached`` as last read."""
        drive, name = self._commands.parameter(tail)
        cached = "cached" in re.split("[;&=]", asked.parameters)
        if cached and asked.key in self._keys.index:
            asked.send([self._render(self._keys.index[asked.key], self._view.epoch_ns(0.0))])
            asked.finish()
            return

        def reply(outcome: Outcome) -> None:
            if not outcome.ok or outcome.value is None:
                asked.fail(keys.outcome_json(outcome), keys.JSON)
                return
            reading = Reading(outcome.value, Quality.GOOD, outcome.time, "")
            asked.send([self._message(asked.key, None, reading, self._view.epoch_ns(outcome.time))])
            asked.finish()

        try:
            identity = self._identity(owner, asked)
            request = self._commands.reading(drive, name, identity, cached=cached)
        except BadCommand as bad:
            _refuse(asked, bad)
            return
        self._view.submit(request, reply)

    def _note_refusal(self, owner: str, tail: str, sent: IncomingQuery | Sample, bad: BadCommand) -> None:
        """A command that was refused before it became a request, for the audit log."""
        try:
            identity = self._identity(owner, sent)
        except BadCommand:
            identity = identity_of(None)
        target, action = self._commands.addressee_of(tail)
        self._view.rejected(Rejection(identity, target, action, bad.code, bad.said))

    def _on_put(self, message: Sample) -> None:
        """A plain put on a command key, if the site allows them. It has no answer."""
        owner, tail = self._users.owner(self._keys.tail(message.key))
        try:
            request = self._request(owner, tail, message.payload, self._identity(owner, message))
        except BadCommand as bad:
            _log.info(
                "zenoh: a put on %s is no command: %s", message.key, bad.message, extra=log_source("puts")
            )
            self._note_refusal(owner, tail, message, bad)
            return
        self._submit(request, message.received_at, lambda _: None)


def _refuse(asked: IncomingQuery, bad: BadCommand) -> None:
    asked.fail(keys.refusal_json(bad.code, bad.message), keys.JSON)


def _config(settings: ZenohTable, space: keys.KeySpace, users: Users) -> zenoh.Config:
    login = users.login
    listen = settings.listen if settings.mode == "peer" else ()
    return zenoh_config(
        # Not as a peer: one that a router connects to waits for it before it tells a client who is alive.
        mode="router" if listen else settings.mode,
        listen=listen,
        connect=settings.connect,
        users=(login.user, login.password, login.file) if login else None,
        access=access_control(space, users, accept_put=settings.accept_put),
        prompt=space.prompt,
        waiting=(space.everything,),
        longest=_LONGEST,
    )
