"""The conditions of a server: their events, their methods, and what clients have missed (OPC 10000-9).

What becomes of a condition is in ``condition_state``; this keeps them, calls that, and tells the
subscriptions. Times are in ms since 1970.
"""

from __future__ import annotations

import asyncio
import uuid
from collections import deque
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import count
from typing import Any, Final, Protocol

from bridge.base.guard import Guard
from bridge.uaserver.address_space import Watchers
from bridge.uaserver.conditions.calls import (
    METHODS,
    ArgumentFault,
    ArgumentKind,
    ConditionMethod,
    arguments,
    call_result,
    target_of,
)
from bridge.uaserver.conditions.condition import NORMAL, Act, Comment, ConditionState, Step
from bridge.uaserver.conditions.condition_fields import (
    AlarmContent,
    ConditionPlace,
    ConditionWords,
    condition_fields,
    event_fields,
    field_value,
)
from bridge.uaserver.filters.eventfilter import Occurrence
from bridge.uaserver.filters.where import Fields
from bridge.uaserver.library import (
    ObjectIds,
    ServiceError,
    StatusCodes,
    node_id,
    text,
    ua,
)
from bridge.uaserver.subscriptions.items import EventItem, system_event
from bridge.uaserver.subscriptions.subscription import Subscription
from bridge.uaserver.subscriptions.subscriptions import Subscriptions

_MOST_WAITING: Final = 10_000
"""Events that wait to be told. Beyond that clients are asked to refresh instead."""
_BATCH: Final = 20
_LONGEST_REFRESH_S: Final = 5.0
"""Time for which a refresh waits for a client to fetch what has filled its queue."""
_PAUSE_S: Final = 0.05
_NO_CONTENT: Final = AlarmContent(text(""), 1)


class ConditionOwner(Protocol):
    """Application that the conditions are of. Its users are those of its sessions."""

    def permits(self, user: Any, method: str) -> bool:
        """Whether this user may call ``method`` of a condition."""
        ...

    async def acknowledging(self, user: Any, condition: ua.NodeId) -> int:
        """Do what an acknowledgement does to what the condition is about; its status code. Only Good
        acknowledges."""
        ...

    def on_call(self, user: Any, condition: ua.NodeId, method: str, code: int) -> None:
        """A method was called, with this outcome."""
        ...


class EventSink(Protocol):
    """Keeper of events for those who ask for them later."""

    def keep(self, fields: Fields) -> None: ...


class RefreshingOwner(Protocol):
    """Session that calls a method."""

    @property
    def identity(self) -> Any: ...


@dataclass(slots=True, eq=False)
class Condition:
    """``event_id`` and ``time_ms`` are those of its latest event; empty and 0 where there was none."""

    place: ConditionPlace
    state: ConditionState = NORMAL
    content: AlarmContent = _NO_CONTENT
    event_id: bytes = b""
    time_ms: float = 0.0


class Conditions:
    """``conditions`` by their NodeIds; ``watched`` has who watches which of their fields."""

    def __init__(
        self,
        subscriptions: Subscriptions,
        owner: ConditionOwner,
        words: ConditionWords,
        epoch_ms: Callable[[], float],
    ) -> None:
        self._subscriptions = subscriptions
        self._owner = owner
        self._words = words
        self._epoch_ms = epoch_ms
        self._waiting: deque[tuple[Sequence[ua.NodeId], Fields]] = deque()
        self._lost = False
        self.sink: EventSink | None = None
        self._changed: dict[ua.NodeId, None] = {}
        self._refreshing: set[int] = set()
        self._guard = Guard("OPC UA alarms")
        self._latest: tuple[tuple[Condition, ConditionState, AlarmContent], Fields] | None = None
        self.conditions: dict[ua.NodeId, Condition] = {}
        self.watched: dict[ua.NodeId, dict[str, Watchers]] = {}
        self.condition_of: Callable[[ua.NodeId], ua.NodeId] = lambda where: where
        """Condition whose methods an object has: it may be one below the condition."""
        self.on_change: Callable[[bool], None] = lambda is_by_user: None
        """Told of each change of a state; ``is_by_user``: somebody has called a method."""

    def add(self, condition: Condition) -> None:
        self.conditions[condition.place.node] = condition

    # what happens to what they watch

    def raised(self, condition: Condition, content: AlarmContent, *, anew: bool) -> None:
        """It is active and says ``content``; ``anew``: for another reason than before."""
        step = condition.state.raised(content.severity, self._epoch_ms(), anew=anew)
        if content != condition.content:
            condition.content = content
            step = Step(step.state, tells=step.state.enabled)
        self._take(condition, step)

    def cleared(self, condition: Condition, content: AlarmContent) -> None:
        """It is not active any more, and says ``content``."""
        condition.content = content
        self._take(condition, condition.state.cleared(self._epoch_ms()))

    def look(self) -> None:
        """Unshelve what has been shelved for long enough."""
        now = self._epoch_ms()
        for condition in self.conditions.values():
            if condition.state.shelved:
                self._take(condition, condition.state.on_time(now))

    def _take(self, condition: Condition, step: Step, *, is_by_user: bool = False) -> None:
        has_changed = step.state != condition.state
        condition.state = step.state
        if step.tells:
            self._tell(condition)
        if has_changed or step.tells:
            self._changed[condition.place.node] = None
            self.on_change(is_by_user)

    def _tell(self, condition: Condition) -> None:
        condition.event_id, condition.time_ms = uuid.uuid4().bytes, self._epoch_ms()
        condition.state = condition.state.told(condition.event_id)
        if len(self._waiting) >= _MOST_WAITING:
            self._waiting.clear()
            self._lost = True
        fields = self.fields(condition)
        self._waiting.append((condition.place.emitters, fields))
        if self.sink:
            self.sink.keep(fields)

    def fields(self, condition: Condition) -> Fields:
        """Fields of its latest event, with what it says by this time."""
        made_for = condition, condition.state, condition.content
        # A client reads one field after the other.
        if self._latest is None or condition.state.shelved or self._latest[0] != made_for:
            at = self._epoch_ms()
            said = condition_fields(condition.place, condition.state, condition.content, self._words, at)
            self._latest = made_for, said | event_fields(condition.event_id, condition.time_ms)
        return self._latest[1]

    # what is told

    async def send_waiting(self) -> None:
        """Tell the subscriptions what has happened, and watchers of a condition's fields."""
        if self._lost:
            self._lost = False
            asking = system_event(
                ObjectIds.RefreshRequiredEventType, "Server", "events were lost: refresh the conditions"
            )
            self._waiting.appendleft(((node_id(ObjectIds.Server),), asking))
        while self._waiting:
            emitters, fields = self._waiting.popleft()
            for subscription in list(self._subscriptions.subscriptions.values()):
                if subscription.is_listening:
                    with self._guard:
                        for emitter in emitters:
                            subscription.hear(Occurrence(emitter, fields))
            await asyncio.sleep(0)
        changed, self._changed = self._changed, {}
        for where in changed:
            if where in self.watched:
                await self._tell_watchers(where)

    async def _tell_watchers(self, where: ua.NodeId) -> None:
        fields = self.fields(self.conditions[where])
        now = asyncio.get_running_loop().time()
        for name, watchers in list(self.watched[where].items()):
            value = field_value(fields, name)
            for watcher in list(watchers.values()):
                with self._guard:
                    watcher.told(value, now)
        await asyncio.sleep(0)

    # the methods

    async def call(self, session: RefreshingOwner, call: ua.CallMethodRequest) -> ua.CallMethodResult:
        """Carry out a call of one of ``METHODS``."""
        where, method_id, given = target_of(call)
        method, user = METHODS[method_id], session.identity
        try:
            taken = arguments(method, given)
            if method.is_refresh:
                await self._refresh(session, where, taken)
                return call_result(StatusCodes.Good)
        except ArgumentFault as error:
            return call_result(int(error.code), error.faults)
        except ServiceError as error:
            return call_result(int(error.code))
        condition = self.conditions.get(self.condition_of(where))
        if condition is None:
            return call_result(StatusCodes.BadNodeIdUnknown)
        code = await self._carry_out(user, condition, method, taken)
        self._owner.on_call(user, condition.place.node, method.name, code)
        return call_result(code)

    async def _carry_out(
        self, user: Any, condition: Condition, method: ConditionMethod, taken: dict[ArgumentKind, Any]
    ) -> int:
        if not self._owner.permits(user, method.name):
            return StatusCodes.BadUserAccessDenied
        now = self._epoch_ms()
        act = Act(taken.get(ArgumentKind.EVENT_ID) or b"", _comment(taken, now), user.name)
        duration_ms = float(taken.get(ArgumentKind.SHELVING_TIME, 0.0))
        step = _step(condition.state, method.name, act, duration_ms, now)
        if method.name == "Acknowledge" and not step.code:
            code = await self._owner.acknowledging(user, condition.place.node)
            if code:
                return code
            # Meanwhile somebody else may have acknowledged it, or it is another one.
            step = condition.state.acknowledge(act, self._epoch_ms())
        self._take(condition, step, is_by_user=True)
        return step.code

    # ConditionRefresh

    async def _refresh(
        self, session: RefreshingOwner, where: ua.NodeId, taken: dict[ArgumentKind, Any]
    ) -> None:
        """Tell a subscription, or one of its items, the conditions of which something is left (§5.5.7).
        Raises ServiceError."""
        if where != node_id(ObjectIds.ConditionType):
            raise ServiceError(StatusCodes.BadMethodInvalid)
        number: int = taken[ArgumentKind.SUBSCRIPTION]
        found = self._subscriptions.subscriptions.get(number)
        if found is None:
            raise ServiceError(StatusCodes.BadSubscriptionIdInvalid)
        if found.owner is not session:
            raise ServiceError(StatusCodes.BadUserAccessDenied)
        items = found.listeners
        if ArgumentKind.ITEM in taken:
            items = [one for one in items if one.number == taken[ArgumentKind.ITEM]]
            if not items:
                raise ServiceError(StatusCodes.BadMonitoredItemIdInvalid)
        with self._refreshing_alone(number):
            _tell_all(found, items, _refresh_event(ObjectIds.RefreshStartEventType))
            latest = asyncio.get_running_loop().time() + _LONGEST_REFRESH_S
            await self._tell_retained(found, items, latest)
            await _until_room(items, latest)
            _tell_all(found, items, _refresh_event(ObjectIds.RefreshEndEventType))

    @contextmanager
    def _refreshing_alone(self, number: int) -> Generator[None]:
        if number in self._refreshing:
            raise ServiceError(StatusCodes.BadRefreshInProgress)
        self._refreshing.add(number)
        try:
            yield
        finally:
            self._refreshing.discard(number)

    async def _tell_retained(self, found: Subscription, items: Sequence[EventItem], latest: float) -> None:
        retained = [one for one in self.conditions.values() if one.state.retain]
        for number, condition in enumerate(retained):
            await _until_room(items, latest)
            fields = self.fields(condition)
            for item in items:
                if item.node in condition.place.emitters:
                    found.tell(item, Occurrence(item.node, fields))
            if number % _BATCH == _BATCH - 1:
                await asyncio.sleep(0)


async def _until_room(items: Sequence[EventItem], latest: float) -> None:
    """Wait until the client has fetched what fills its queues, not beyond ``latest``."""
    for _ in count():
        if not any(item.is_full for item in items) or asyncio.get_running_loop().time() >= latest:
            return
        await asyncio.sleep(_PAUSE_S)


def _step(state: ConditionState, name: str, act: Act, duration_ms: float, now_ms: float) -> Step:
    match name:
        case "Enable":
            return state.enable(act, now_ms)
        case "Disable":
            return state.disable(act, now_ms)
        case "AddComment":
            return state.add_comment(act, now_ms)
        case "Acknowledge":
            return state.acknowledge(act, now_ms)
        case "Confirm":
            return state.confirm(act, now_ms)
        case "TimedShelve":
            return state.timed_shelve(act, duration_ms, now_ms)
        case "OneShotShelve":
            return state.one_shot_shelve(act, now_ms)
        case _:
            return state.unshelve(act, now_ms)


def _comment(taken: dict[ArgumentKind, Any], now_ms: float) -> Comment:
    given: ua.LocalizedText | None = taken.get(ArgumentKind.COMMENT)
    if given is None:
        return Comment()
    return Comment(given.Text or "", given.Locale or "", "", now_ms)


def _tell_all(found: Subscription, items: Sequence[EventItem], fields: Fields) -> None:
    for item in items:
        found.tell(item, Occurrence(item.node, fields, is_of_refresh=True))


def _refresh_event(kind: int) -> Fields:
    said = "begins" if kind == ObjectIds.RefreshStartEventType else "is complete"
    return system_event(kind, "Server", f"the refresh of the conditions {said}")
