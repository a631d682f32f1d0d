"""The Publish requests of a session, and the subscriptions that wait for one (OPC 10000-4 §5.14.5)."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final, Protocol

from bridge.uaserver.library import StatusCodes, ua

MOST_BYTES: Final = 1024 * 1024
"""Approximate size of the notifications in one message; what is left follows with the next request."""

_MORE_THAN_SUBSCRIPTIONS: Final = 10
"""A server takes more Publish requests than there are subscriptions, but not without end."""


@dataclass(frozen=True, slots=True, eq=False)
class PublishRequest:
    """Publish request that is not answered yet. ``results`` are those of its acknowledgements.

    It is worth nothing once ``is_open`` says no: its connection is gone, or its session is elsewhere.
    """

    expires_at: float
    is_open: Callable[[], bool]
    answer: Callable[[ua.PublishResult], None]
    refuse: Callable[[int], None]
    most_bytes: int = MOST_BYTES
    """Approximate size of the notifications: the last one may go beyond it."""
    handle: int = 0
    """Handle that its client has given it, and names in a Cancel."""
    results: list[ua.StatusCode] = field(default_factory=list[ua.StatusCode])


class PublishingSubscription(Protocol):
    """A subscription, as far as its turn is concerned."""

    @property
    def priority(self) -> int: ...

    def publish(self, request: PublishRequest) -> bool:
        """Answer the request; whether there is more to tell at once."""
        ...


class PublishQueue:
    """Brings the requests of one session and its subscriptions together."""

    def __init__(self) -> None:
        self._requests: deque[PublishRequest] = deque()
        self._late: dict[PublishingSubscription, None] = {}
        """Subscriptions that have something to tell and nobody to tell it to, in their order."""
        self._parting: deque[ua.PublishResult] = deque()
        """Last words of subscriptions that are no longer this session's."""

    @property
    def has_last_words(self) -> bool:
        return bool(self._parting)

    def put(self, request: PublishRequest, subscriptions: int, now: float) -> None:
        """A request has come; the session has so many subscriptions."""
        self._requests.append(request)
        self._serve(now)
        while len(self._requests) > subscriptions + _MORE_THAN_SUBSCRIPTIONS:
            oldest = self._take(now)
            if oldest:
                oldest.refuse(StatusCodes.BadTooManyPublishRequests)

    def ask(self, subscription: PublishingSubscription, now: float) -> bool:
        """``subscription`` has something to tell, now or as soon as a request is there; whether one was."""
        self._late.setdefault(subscription)
        self._serve(now)
        return subscription not in self._late

    def __len__(self) -> int:
        return len(self._requests)

    def forget(self, subscription: PublishingSubscription) -> None:
        self._late.pop(subscription, None)

    def say_last(self, result: ua.PublishResult, now: float) -> None:
        """The last word of a subscription that this session has no longer."""
        self._parting.append(result)
        self._serve(now)

    def cancel(self, handle: int) -> int:
        """Answer the requests that the client calls so (OPC 10000-4 §5.7.5); how many there were."""
        cancelled = [one for one in self._requests if one.handle == handle and one.is_open()]
        for request in cancelled:
            self._requests.remove(request)
            request.refuse(StatusCodes.BadRequestCancelledByClient)
        return len(cancelled)

    def refuse_all(self, code: int, now: float) -> None:
        while request := self._take(now):
            request.refuse(code)

    def close(self, now: float) -> None:
        self._late.clear()
        self._parting.clear()
        self.refuse_all(StatusCodes.BadSessionClosed, now)

    def _serve(self, now: float) -> None:
        while (self._late or self._parting) and (request := self._take(now)):
            if self._parting:
                result = self._parting.popleft()
                result.Results = request.results
                request.answer(result)
                continue
            # The first of those with the highest priority.
            subscription = max(self._late, key=lambda late: late.priority)
            del self._late[subscription]
            if subscription.publish(request):
                self._late[subscription] = None

    def _take(self, now: float) -> PublishRequest | None:
        """The oldest request that is worth an answer."""
        while self._requests:
            request = self._requests.popleft()
            if not request.is_open():
                continue
            if request.expires_at > now:
                return request
            request.refuse(StatusCodes.BadTimeout)
        return None
