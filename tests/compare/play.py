"""A case is played: each request goes to every server, and the answers are compared before the next one.

Where the servers differ, what one of them has made and another has not is taken back, so that all of them
stand where the others do and the case can go on.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import Any, Final, Protocol

from asyncua import ua

from tests.compare import space
from tests.compare.asked import NO_SESSION, Anonymous, Ask, Memory, Nonce
from tests.compare.channel import Channel, ChannelClosedError
from tests.compare.facts import Facts, code_name, facts_of
from tests.compare.servers import NAMES

_SESSION_MS: Final = 60_000
_OPERATION: Final = re.compile(r"(.*?\[(\d+)\])")


class Party(Memory):
    """One server, as its client sees it."""

    def __init__(self, name: str, port: int) -> None:
        super().__init__()
        self.name = name
        self._port = port
        self._channels: dict[int, Channel] = {}
        self.session = NO_SESSION
        self.publishing: list[int] = []
        """Publish requests that are not answered yet."""
        self.messages: dict[int, list[tuple[int, Any]]] = {}
        """Sequence numbers and contents of the messages of a subscription that are not acknowledged."""
        self.acknowledged: dict[int, list[int]] = {}
        self.sent: Any = None
        """The newest request."""
        self.live: set[int] = set()
        """Subscriptions of which something has to come after each publishing interval."""
        self.odd: set[int] = set()
        """Those of which it is unknown when something comes."""

    def channel(self, number: int = 0) -> Channel:
        if number not in self._channels:
            self._channels[number] = Channel(self._port)
        return self._channels[number]

    def log_in(self) -> None:
        self.session = self.new_session(0)

    def new_session(self, channel: int) -> ua.NodeId:
        created = self.ask(Ask("CreateSession", session_terms(), session=NO_SESSION, channel=channel))
        session: ua.NodeId = created.Parameters.AuthenticationToken
        self.policy = anonymous_policy(created)
        asked = {"UserIdentityToken": Anonymous()}
        activated = self.ask(Ask("ActivateSession", asked, session=session, channel=channel))
        assert activated.ResponseHeader.ServiceResult.is_good(), activated
        return session

    def send(self, step: Ask) -> int:
        session = self.session if step.session is None else self.filled(step.session)
        self.sent = self.request(step)
        return self.channel(step.channel).send(step.service, self.sent, session)

    def ask(self, step: Ask) -> Any:
        return self.channel(step.channel).receive(self.send(step))

    def close(self) -> None:
        for number, channel in self._channels.items():
            sessions = [self.session] if number == 0 and self.session != NO_SESSION else []
            for session in [*sessions, *self.made.get("session", ())]:
                with suppress(ChannelClosedError, TimeoutError):
                    self.ask(
                        Ask("CloseSession", {"DeleteSubscriptions": True}, session=session, channel=number)
                    )
            channel.close()


def session_terms() -> dict[str, Any]:
    return {
        "EndpointUrl": "opc.tcp://127.0.0.1:4840",
        "RequestedSessionTimeout": float(_SESSION_MS),
        "ClientNonce": Nonce(),
        "SessionName": "compare",
    }


def anonymous_policy(created: Any) -> str | None:
    return next(
        token.PolicyId
        for endpoint in created.Parameters.ServerEndpoints
        for token in endpoint.UserIdentityTokens
        if token.TokenType == ua.UserTokenType.Anonymous
    )


class Step(Protocol):
    """One step of a case. ``service`` names it in the table of differences."""

    @property
    def service(self) -> str: ...

    def play(self, play: Play) -> None: ...


@dataclass(frozen=True, slots=True)
class Seen:
    """Difference between servers: ``values`` of the fact at ``path``, by server. ``operation`` is what was
    asked there."""

    service: str
    path: str
    values: Mapping[str, Any]
    step: Any
    operation: Any = None

    def __str__(self) -> str:
        values = ", ".join(f"{name}: {value}" for name, value in self.values.items())
        return f"{self.step!r}\n  {self.path}: {values}"


@dataclass
class Play:
    """``seen`` are the differences; ``asked`` counts requests, ``told`` what was told of items."""

    parties: Sequence[Party]
    seen: list[Seen] = field(default_factory=list[Seen])
    asked: int = 0
    told: int = 0

    def run(self, steps: Sequence[Any]) -> None:
        for step in steps:
            if isinstance(step, Ask):
                self.ask(step)
            else:
                step.play(self)

    def ask(self, step: Ask) -> list[Any]:
        """The answers, None from a server that has closed the connection."""
        self.asked += 1
        numbers = [_or_closed(lambda one=one: one.send(step)) for one in self.parties]
        answers: list[Any] = []
        for one, number in zip(self.parties, numbers, strict=True):
            answer = number
            if isinstance(number, int):
                answer = _or_closed(lambda one=one, number=number: one.channel(step.channel).receive(number))
            answers.append(answer)
        found = [_facts(answer, step.service) for answer in answers]
        self.compare(step.service, step, found)
        if any(isinstance(answer, ChannelClosedError) for answer in answers):
            raise EndOfCaseError
        self._keep(step, answers)
        for one, answer in zip(self.parties, answers, strict=True):
            _note_ends(one, step, answer)
        return answers

    def compare(self, service: str, step: Any, found: Sequence[Facts]) -> None:
        for path in _differing(found):
            values = {one.name: facts.get(path) for one, facts in zip(self.parties, found, strict=True)}
            self.seen.append(Seen(service, path, values, step, _operation(step, path)))

    def _keep(self, step: Ask, answers: Sequence[Any]) -> None:
        if step.service == "ModifyMonitoredItems":
            self._keep_alike(step, answers)
        if step.service == "SetTriggering" and self.seen and self.seen[-1].step is step:
            self._drop_item(step, step.asked["TriggeringItemId"])
        if not step.makes:
            return
        made = [_made(step.makes, answer) for answer in answers]
        sent = {one.name: one.sent for one in self.parties}
        for place in range(max(map(len, made))):
            each = [ids[place] if place < len(ids) else None for ids in made]
            for one, number in zip(self.parties, each, strict=True):
                if all(each):
                    one.made.setdefault(step.makes, []).append(number)
                    if step.makes == "subscription":
                        one.live.add(number)
                    elif step.makes == "item":
                        asked = sent[one.name].Parameters.ItemsToCreate[place].RequestedParameters
                        one.handles_of[number] = asked.ClientHandle
                    elif step.makes == "odd subscription":
                        one.odd.add(number)
                elif number is not None and step.makes in _TAKE_BACK:
                    one.ask(_TAKE_BACK[step.makes](step, number))

    def _keep_alike(self, step: Ask, answers: Sequence[Any]) -> None:
        """Items that not all servers have changed go, and those that none has: node-opcua has forgotten the
        filter of an item whose change it refuses."""
        if any(isinstance(answer, ua.ServiceFault) for answer in answers):
            return
        for place, asked in enumerate(step.asked["ItemsToModify"]):
            if not all(answer.Results[place].StatusCode.is_good() for answer in answers):
                self._drop_item(step, asked.MonitoredItemId)

    def _drop_item(self, step: Ask, item: Any) -> None:
        for one in self.parties:
            one.ask(_TAKE_BACK["item"](step, one.filled(item)))

    def each(self, service: str, step: Any, act: Callable[[Party], Facts]) -> None:
        """Compare what each of them gives, at the same time."""
        self.asked += 1
        with ThreadPoolExecutor(len(self.parties)) as pool:
            given = list(pool.map(lambda one: _or_closed(lambda: act(one)), self.parties))
        closed = [one for one in given if isinstance(one, ChannelClosedError)]
        self.compare(service, step, [_facts(one, service) if one in closed else one for one in given])
        if closed:
            raise EndOfCaseError
        self.told += sum(len(one) for one in given[0].values() if isinstance(one, list))


class EndOfCaseError(Exception):
    """A server has closed its connection: the case cannot go on."""


def _or_closed(act: Callable[[], Any]) -> Any:
    try:
        return act()
    except ChannelClosedError as error:
        return error


def _facts(answer: Any, service: str) -> Facts:
    if isinstance(answer, ChannelClosedError):
        return {"result": f"closes the connection: {code_name(answer.code)}" if answer.code else "closes"}
    return facts_of(answer, service)


def _differing(found: Sequence[Facts]) -> Iterator[str]:
    """Places at which the facts are not the same, without what follows from a status code."""
    paths = list(dict.fromkeys(path for facts in found for path in facts))
    different = {path for path in paths if any(facts.get(path) != found[0].get(path) for facts in found)}
    if "result" in different:
        yield "result"
        return
    for path in paths:
        operation = _OPERATION.match(path)
        code = f"{operation[1]}.StatusCode" if operation else ""
        if path in different and (path == code or code not in different):
            yield path


_OPERATIONS: Final = {
    "Read": "NodesToRead",
    "Write": "NodesToWrite",
    "HistoryRead": "NodesToRead",
    "Browse": "NodesToBrowse",
    "BrowseNext": "ContinuationPoints",
    "TranslateBrowsePathsToNodeIds": "BrowsePaths",
    "Call": "MethodsToCall",
    "CreateMonitoredItems": "ItemsToCreate",
    "ModifyMonitoredItems": "ItemsToModify",
    "SetMonitoringMode": "MonitoredItemIds",
    "DeleteMonitoredItems": "MonitoredItemIds",
    "SetPublishingMode": "SubscriptionIds",
    "DeleteSubscriptions": "SubscriptionIds",
    "TransferSubscriptions": "SubscriptionIds",
}
"""Parameter that has the operations of a service."""


def _operation(step: Any, path: str) -> Any:
    found = _OPERATION.match(path)
    name = _OPERATIONS.get(step.service) if isinstance(step, Ask) else None
    operations = step.asked.get(name) if name else None
    return operations[int(found[2])] if found and operations and int(found[2]) < len(operations) else None


def _made(kind: str, answer: Any) -> list[Any]:
    """Ids in an answer; None for what was refused."""
    if isinstance(answer, ua.ServiceFault):
        return [None]
    if kind in ("subscription", "odd subscription"):
        return [answer.Parameters.SubscriptionId]
    if kind in ("session", "odd session"):
        return [answer.Parameters.AuthenticationToken]
    if kind == "item":
        return [one.MonitoredItemId if one.StatusCode.is_good() else None for one in answer.Results]
    results = answer.Results if hasattr(answer, "Results") else answer.Parameters.Results
    return [one.ContinuationPoint or None for one in results]


def _note_ends(party: Party, step: Ask, answer: Any) -> None:
    if step.service != "DeleteSubscriptions" or isinstance(answer, ua.ServiceFault):
        return
    for asked, code in zip(step.asked["SubscriptionIds"], answer.Results or (), strict=True):
        if code.is_good():
            party.live.discard(party.filled(asked))
            party.odd.discard(party.filled(asked))


_TAKE_BACK: Final[Mapping[str, Callable[[Ask, Any], Ask]]] = {
    "subscription": lambda step, number: Ask("DeleteSubscriptions", {"SubscriptionIds": [number]}),
    "odd subscription": lambda step, number: Ask("DeleteSubscriptions", {"SubscriptionIds": [number]}),
    "item": lambda step, number: Ask(
        "DeleteMonitoredItems",
        {"SubscriptionId": step.asked["SubscriptionId"], "MonitoredItemIds": [number]},
    ),
    "session": lambda step, number: Ask("CloseSession", {}, session=number, channel=step.channel),
    "point": lambda step, number: Ask(
        "BrowseNext", {"ReleaseContinuationPoints": True, "ContinuationPoints": [number]}
    ),
}


@contextmanager
def playing(
    ports: Mapping[str, int], names: Sequence[str] = NAMES, *, logged_in: bool = True
) -> Iterator[Play]:
    """A play with each server, with sessions of its own, and all variables as they are at first."""
    parties = [Party(name, ports[name]) for name in names]
    try:
        for one in parties:
            if logged_in:
                one.log_in()
                written = [set_value(variable.id, variable.value) for variable in space.VARIABLES]
                one.ask(Ask("Write", {"NodesToWrite": written}))
        yield Play(parties)
    finally:
        for one in parties:
            one.close()


_TYPES: Final = {one.id: getattr(ua.VariantType, one.type) for one in space.VARIABLES}


def set_value(variable: str, value: Any) -> ua.WriteValue:
    held = ua.DataValue(ua.Variant(value, _TYPES[variable]))
    return ua.WriteValue(NodeId=ua.NodeId(variable, 1), AttributeId=ua.AttributeIds.Value, Value=held)


def settle() -> None:
    """Until every server has sampled what was written."""
    time.sleep(0.06)
