"""Messages that are sent and received through a link, in our own types."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

_SOURCE_PLACE: Final = re.compile(r"\s+at /\S+?\.rs:\d+\.?")


@dataclass(frozen=True, slots=True)
class Sample:
    """A payload with its key, sent or received. ``encoding`` is zenoh's name for it; ``received_at`` is in
    monotonic seconds; ``source`` is the id of the sender's zenoh session, where it gives it, not proved."""

    key: str
    payload: bytes
    encoding: str = ""
    attachment: bytes | None = None
    received_at: float = 0.0
    source: str = ""


@dataclass(frozen=True, slots=True)
class GetReply:
    """One reply to a ``get``; if ``ok`` is False, the payload says why."""

    ok: bool
    message: Sample


def sentence(error: Exception) -> str:
    """zenoh's message without file names and lines of its source."""
    return _SOURCE_PLACE.sub("", str(error)).strip()
