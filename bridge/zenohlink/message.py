"""What is sent and received through a link, in our own types."""

# pyright: reportUnknownMemberType=false
# zenoh's stubs leave out the return types of what returns nothing.

from __future__ import annotations

import re
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import zenoh

_SOURCE_PLACE: Final = re.compile(r"\s+at /\S+?\.rs:\d+\.?")


@dataclass(frozen=True, slots=True)
class Message:
    """A payload with its key, sent or received. ``encoding`` is zenoh's name for it; ``received_at`` is in
    monotonic seconds."""

    key: str
    payload: bytes
    encoding: str = ""
    attachment: bytes | None = None
    received_at: float = 0.0


@dataclass(frozen=True, slots=True)
class Answer:
    """One reply to a ``get``; if ``ok`` is False, the payload says why."""

    ok: bool
    message: Message


def publish(session: zenoh.Session, message: Message) -> None:
    """Never waits for a peer that does not read: that peer loses the message."""
    session.put(
        message.key,
        message.payload,
        encoding=message.encoding or None,
        attachment=message.attachment,
        congestion_control=zenoh.CongestionControl.DROP,
    )


def reply(query: zenoh.Query, messages: Sequence[Message], stamp: zenoh.Timestamp) -> None:
    """``stamp``: if a storage has another sample of the key, the client's zenoh takes the newer one, and one
    without a time counts as the oldest."""
    for message in messages:
        query.reply(
            message.key,
            message.payload,
            encoding=message.encoding or None,
            attachment=message.attachment,
            timestamp=stamp,
        )


def reply_error(query: zenoh.Query, payload: bytes, encoding: str) -> None:
    """Answer with an error and finish the query."""
    try:
        query.reply_err(payload, encoding=encoding)
    finally:
        query.drop()


def to_answer(reply: zenoh.Reply) -> Answer:
    result = reply.result
    if isinstance(result, zenoh.Sample):
        return Answer(True, to_message(result))
    return Answer(False, Message("", result.payload.to_bytes(), str(result.encoding)))


def to_message(sample: zenoh.Sample) -> Message:
    attachment = to_bytes(sample.attachment)
    payload, encoding = sample.payload.to_bytes(), str(sample.encoding)
    return Message(str(sample.key_expr), payload, encoding, attachment, time.monotonic())


def to_bytes(data: zenoh.ZBytes | None) -> bytes | None:
    return None if data is None else data.to_bytes()


def sentence(error: Exception) -> str:
    """zenoh's message without file names and lines of its source."""
    return _SOURCE_PLACE.sub("", str(error)).strip()
