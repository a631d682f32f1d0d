"""The event loop's side of a zenoh session."""

# pyright: reportUnknownMemberType=false, reportUnknownLambdaType=false
# zenoh's stubs leave out the return types of what returns nothing.

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Final, TypeVar, cast

import zenoh

from bridge.base.errors import OperationFailed, Unavailable
from bridge.zenohlink.incoming_query import IncomingQuery
from bridge.zenohlink.lane import LIMIT, Job, Lane
from bridge.zenohlink.message import GetReply, Sample, sentence
from bridge.zenohlink.publishers import Publishers, Readers, Value
from bridge.zenohlink.worker import CallQueue, Worker

Result = TypeVar("Result")

_log = logging.getLogger(__name__)

_PUTS_AT_ONCE: Final = 100
"""Puts made before another job gets its turn: with a stalled subscriber each takes up to 1 ms."""

Share = Callable[[str, bytes | None], str]
"""The share of the ``CallQueue`` in which a query or sample waits, by key and payload."""


def _one_for_all(key: str, payload: bytes | None) -> str:
    return ""


class ZenohLink:
    """A zenoh session on a worker thread. All methods are called from the event loop.

    ``name`` is used in messages to the user, ``encoding`` is that of all values that are published. Handlers
    are called in the loop. Declarations and messages keep their order, but for values.

    Queries are answered in two further lanes: one for keys with ``is_prompt``, whose replies never wait
    (``prompt`` of the session's settings), and one for all others. ``on_strangers`` gets the addresses of
    connections that did not become a session. Both are given if strangers connect.
    """

    def __init__(
        self,
        config: zenoh.Config,
        name: str,
        is_prompt: Callable[[str], bool] | None = None,
        on_strangers: Callable[[list[str]], None] | None = None,
        encoding: str = "",
    ) -> None:
        self.name = name
        self._is_prompt = is_prompt or (lambda _: True)
        self._worker = Worker(
            config,
            name,
            self._on_opened,
            self._on_closed,
            on_strangers and (lambda places: self._inbox.take_in(partial(on_strangers, places))),
        )
        self._publishers = Publishers(encoding)
        self.is_publishing = False
        """True while what was given to ``publish`` last is not sent yet."""

    @property
    def errors(self) -> int:
        """Calls that zenoh refused."""
        return self._worker.errors

    # life

    async def open(self, patience_s: float = 2.0) -> bool:
        """Open the session. False: nobody has answered yet (client mode); it keeps trying, and meanwhile
        declarations and messages wait.

        Raises Unavailable with the reason if zenoh refuses.
        """
        self._loop = asyncio.get_running_loop()
        self._inbox = CallQueue()
        self._opened: asyncio.Future[Exception | None] = self._loop.create_future()
        self._closed: asyncio.Future[None] = self._loop.create_future()
        self._worker.start()
        try:
            error = await asyncio.wait_for(asyncio.shield(self._opened), patience_s)
        except TimeoutError:
            return False
        if error is not None:
            raise Unavailable(f"{self.name}: {sentence(error)}")
        return True

    async def close(self, timeout_s: float = 2.0) -> bool:
        """Close the session. False: zenoh did not end in time and was abandoned."""
        if self._worker.is_stopping or not self._worker.is_alive:
            return True
        self._inbox.is_closed = True
        self._worker.stop()
        await asyncio.wait((self._closed,), timeout=timeout_s)
        if not self._closed.done():
            _log.warning("%s: the zenoh session did not close within %g s", self.name, timeout_s)
        return self._closed.done()

    async def failed(self) -> None:
        """Wait until the link is closed. Raises ``OperationFailed`` if it ended without being closed: nothing
        is sent or received any more."""
        await asyncio.shield(self._closed)
        if not self._worker.is_stopping:
            raise OperationFailed(f"{self.name}: the zenoh session has ended by itself")

    def _on_opened(self, error: Exception | None) -> None:
        self._inbox.tell(_resolve, self._opened, error)

    def _on_closed(self) -> None:
        self._inbox.tell(_resolve, self._closed, None)

    # sending

    def publish(self, values: Sequence[Value]) -> bool:
        """Publish each value; a reader who does not keep up loses some. False: there was no room.

        Whoever waits until ``is_publishing`` is over has at most the newest value of each key wait.
        """

        def put_some(rest: Sequence[Value], session: zenoh.Session) -> None:
            put = self._publishers.put
            for value in rest[:_PUTS_AT_ONCE]:
                try:
                    put(session, value)
                except Exception as error:  # noqa: BLE001 - one bad value must not stop the others
                    self._worker.complain(error)
            if rest := rest[_PUTS_AT_ONCE:]:
                self._worker.do(partial(put_some, rest))
            else:
                self.is_publishing = False

        self.is_publishing = True
        if not self.submit(partial(put_some, values)):
            self.is_publishing = False
        return self.is_publishing

    def send(self, message: Sample) -> bool:
        """Publish each message in order. False: there was no room, the message is dropped."""
        return self.submit(lambda session: _publish(session, message))

    def submit(self, job: Job) -> bool:
        """Let the worker do ``job``. False: there was no room, or the worker has ended."""
        if self._worker.is_stopping or not self._worker.is_alive or self._worker.waiting >= LIMIT:
            return False
        self._worker.do(job)
        return True

    async def settle(self, lane: Lane | None = None) -> None:
        """Wait until the worker, or ``lane``, has done all jobs given so far."""
        done: asyncio.Future[None] = self._loop.create_future()
        if (lane.do if lane else self.submit)(lambda _: self._inbox.tell(_resolve, done, None)):
            await asyncio.wait((done, self._closed), return_when=asyncio.FIRST_COMPLETED)

    def own_lane(self, like: Lane) -> Lane:
        return self._worker.lane(like.session)

    # asking

    async def get(
        self,
        key: str,
        payload: bytes | None = None,
        *,
        timeout_s: float = 2.0,
        attachment: bytes | None = None,
    ) -> list[GetReply]:
        """The replies to a query; none if nobody answers within ``timeout_s``."""
        answers: list[GetReply] = []
        done: asyncio.Future[None] = self._loop.create_future()

        def on_reply(reply: zenoh.Reply) -> None:
            answers.append(_to_answer(reply))

        def on_end() -> None:
            self._inbox.tell(_resolve, done, None)

        def ask(session: zenoh.Session) -> None:
            try:
                session.get(
                    key,
                    zenoh.handlers.Callback(on_reply, on_end, indirect=False),
                    payload=payload,
                    attachment=attachment,
                    timeout=timeout_s,
                    consolidation=zenoh.ConsolidationMode.NONE,
                    congestion_control=zenoh.CongestionControl.BLOCK,
                    express=True,
                )
            except Exception:
                on_end()
                raise

        if self.submit(ask):
            # zenoh applies the time-out; this one is for a worker that is too busy to ask.
            waiting = (done, self._closed)
            await asyncio.wait(waiting, timeout=timeout_s + 0.1, return_when=asyncio.FIRST_COMPLETED)
        return list(answers)

    # declaring

    def follow_readers(self, key: str, handler: Callable[[bool], None]) -> None:
        """Call ``handler`` when somebody else begins to subscribe to some of what matches ``key``, and when
        nobody does any more."""
        readers = Readers(handler, self._inbox.tell)

        def declare(session: zenoh.Session) -> None:
            publisher = session.declare_publisher(key, allowed_destination=zenoh.Locality.REMOTE)
            callback = zenoh.handlers.Callback(readers.on_status, indirect=False)
            self._worker.declared += [publisher.declare_matching_listener(callback), publisher]
            # Those that were there before. Of the first one since then the listener may have been told.
            status = cast(zenoh.MatchingStatus, publisher.matching_status)  # a bool in zenoh's stubs
            if status.matching:
                readers.on_status(status)

        self.submit(declare)

    def declare_queryable(
        self, key: str, handler: Callable[[IncomingQuery], None], share: Share = _one_for_all
    ) -> None:
        """Answer queries on ``key``. A flood of them is cut off before it reaches the loop."""

        def declare(session: zenoh.Session) -> None:
            prompt, other = self._worker.answers(session)

            def on_query(query: zenoh.Query) -> None:
                payload, attachment = _to_bytes(query.payload), _to_bytes(query.attachment)
                parameters = str(query.parameters)
                key, now = str(query.key_expr), time.monotonic()
                lane = prompt if self._is_prompt(key) else other
                source = _source(query.source_info)
                asked = IncomingQuery(key, payload, attachment, parameters, now, source, query, self, lane)
                if not self._inbox.take_in(partial(handler, asked), share(key, payload)):
                    # Not here: ending a query may wait for its client, and this thread reads for all others.
                    lane.do(lambda _: query.drop())

            # Complete, so that a storage of these keys is not asked in our place.
            callback = zenoh.handlers.Callback(on_query, indirect=False)
            self._worker.declared.append(session.declare_queryable(key, callback, complete=True))

        self.submit(declare)

    def declare_subscriber(
        self,
        key: str,
        handler: Callable[[Sample], None],
        share: Share = _one_for_all,
        *,
        from_others: bool = False,
    ) -> None:
        """Subscribe to ``key``, once, until ``drop_subscriber``; ``from_others`` leaves out what this session
        itself publishes."""
        origin = zenoh.Locality.REMOTE if from_others else zenoh.Locality.ANY

        def on_sample(sample: zenoh.Sample) -> None:
            if sample.kind == zenoh.SampleKind.PUT:
                message = _to_message(sample)
                self._inbox.take_in(partial(handler, message), share(message.key, message.payload))

        def declare(session: zenoh.Session) -> None:
            callback = zenoh.handlers.Callback(on_sample, indirect=False)
            subscriber = session.declare_subscriber(key, callback, allowed_origin=origin)
            self._worker.subscribers[key] = subscriber

        self.submit(declare)

    def drop_subscriber(self, key: str) -> None:
        """End a subscription. Of samples that have come already, some may still be handed over."""

        def undeclare(_: zenoh.Session) -> None:
            subscriber = self._worker.subscribers.pop(key, None)
            if subscriber:
                subscriber.undeclare()

        self.submit(undeclare)

    def follow_liveliness(self, key: str, handler: Callable[[str, bool], None]) -> None:
        """Call ``handler(key, is_alive)`` for each existing token, and whenever one appears or disappears."""

        def on_sample(sample: zenoh.Sample) -> None:
            self._inbox.take_in(partial(handler, str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT))

        def declare(session: zenoh.Session) -> None:
            callback = zenoh.handlers.Callback(on_sample, indirect=False)
            self._worker.declared.append(session.liveliness().declare_subscriber(key, callback, history=True))

        self.submit(declare)

    def follow_endings(self, handler: Callable[[str], None]) -> None:
        """Call ``handler`` with the id of each zenoh session to which the connection has ended."""

        def on_event(event: zenoh.TransportEvent) -> None:
            if event.kind == zenoh.SampleKind.DELETE:
                self._inbox.take_in(partial(handler, str(event.transport.zid)))

        def declare(session: zenoh.Session) -> None:
            callback = zenoh.handlers.Callback(on_event, indirect=False)
            self._worker.declared.append(session.info.declare_transport_events_listener(callback))

        self.submit(declare)

    def declare_token(self, key: str) -> None:
        """Hold a liveliness token until ``drop_token``."""

        def declare(session: zenoh.Session) -> None:
            if key not in self._worker.tokens:
                self._worker.tokens[key] = session.liveliness().declare_token(key)

        self.submit(declare)

    def drop_token(self, key: str) -> None:
        def undeclare(_: zenoh.Session) -> None:
            token = self._worker.tokens.pop(key, None)
            if token:
                token.undeclare()

        self.submit(undeclare)


def _resolve(future: asyncio.Future[Result], result: Result) -> None:
    if not future.done():
        future.set_result(result)


def _publish(session: zenoh.Session, message: Sample) -> None:
    """Never waits for a peer that does not read: that peer loses the message."""
    session.put(
        message.key,
        message.payload,
        encoding=message.encoding or None,
        attachment=message.attachment,
        congestion_control=zenoh.CongestionControl.DROP,
    )


def _to_answer(reply: zenoh.Reply) -> GetReply:
    result = reply.result
    if isinstance(result, zenoh.Sample):
        return GetReply(True, _to_message(result))
    return GetReply(False, Sample("", result.payload.to_bytes(), str(result.encoding)))


def _to_message(sample: zenoh.Sample) -> Sample:
    attachment, source = _to_bytes(sample.attachment), _source(sample.source_info)
    payload, encoding = sample.payload.to_bytes(), str(sample.encoding)
    return Sample(str(sample.key_expr), payload, encoding, attachment, time.monotonic(), source)


def _source(info: zenoh.SourceInfo | None) -> str:
    """Id of the session that says of itself that it has sent this; empty where none does."""
    return "" if info is None else str(info.source_id.zid)


def _to_bytes(data: zenoh.ZBytes | None) -> bytes | None:
    return None if data is None else data.to_bytes()
