"""The Write service: what clients write becomes telegrams and requests for parameters, outcomes become
status codes.

All command points of one drive in one Write call are one telegram, so that a control word and its
setpoint reach the drive together, and each of them gets the telegram's outcome.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

from asyncua.server.address_space import AddressSpace

from bridge.base.quietlog import log_source
from bridge.command.messages.request import (
    Action,
    Code,
    Command,
    Identity,
    Outcome,
    Request,
    SetTimeout,
    Write,
    WriteParameter,
)
from bridge.image import Value
from bridge.image.point import WriteKind
from bridge.northbound.opcua.requests.outcome_texts import explanation
from bridge.northbound.opcua.space.data_values import outcome_status, plain_value, point_value, rejection
from bridge.northbound.opcua.space.nodes import VariableNode
from bridge.northbound.opcua.space.permissions import COMMAND_OF
from bridge.northbound.view import View
from bridge.text import Text
from bridge.uaserver.arrivals import received_at
from bridge.uaserver.explanations import Explain
from bridge.uaserver.library import GOOD, AttributeIds, ServiceError, StatusCodes, get, status, ua

_log = logging.getLogger(__name__)

ANSWER_LIMIT_S: Final = 10.0
"""Longest wait for an outcome, seconds. No request takes longer (a start takes 3 s): after this the link to
the bus counts as broken."""


@dataclass(slots=True)
class _Telegram:
    """One telegram to one drive. ``places`` are the positions in the call that it answers."""

    target: str
    kind: type[Write | WriteParameter | SetTimeout]
    values: dict[str, Value] = field(default_factory=dict[str, Value])
    places: list[int] = field(default_factory=list[int])
    fault: int = StatusCodes.Good
    misfits: dict[str, Value] = field(default_factory=dict[str, Value])
    """Written values that are at fault, by point, as far as they are values at all."""

    def command(self) -> Command:
        if self.kind is Write:
            return Write(self.values)
        ((name, value),) = self.values.items()
        return WriteParameter(name, value) if self.kind is WriteParameter else SetTimeout(int(value))


async def ask(view: View, request: Request) -> Outcome:
    """Make a request and wait for its outcome."""
    outcome: asyncio.Future[Outcome] = asyncio.get_running_loop().create_future()

    def reply(found: Outcome) -> None:
        if not outcome.done():
            outcome.set_result(found)

    view.submit(replace(request, received_at=received_at.get()), reply)
    try:
        async with asyncio.timeout(ANSWER_LIMIT_S):
            return await outcome
    except TimeoutError:
        _log.warning(
            "%s on %s: no outcome within %g s",
            request.action,
            request.target,
            ANSWER_LIMIT_S,
            extra=log_source(request.target),
        )
        return Outcome(Code.TIMED_OUT, Text.of("request.no_outcome"), forwarded=False)


class Writer:
    """Carries out Write calls. ``writable`` finds the points that may be written."""

    def __init__(
        self, view: View, space: AddressSpace, writable: Callable[[ua.NodeId], VariableNode | None]
    ) -> None:
        self._view = view
        self._space = space
        self._writable = writable

    async def write(
        self, identity: Identity, writes: Sequence[ua.WriteValue], explain: Explain
    ) -> list[ua.StatusCode]:
        """One status code for each of ``writes``, in their order; what the plant refuses is explained."""
        results = [GOOD] * len(writes)
        telegrams: list[_Telegram] = []
        latest: dict[str, _Telegram] = {}
        for place, write in enumerate(writes):
            node = self._writable(get(write, "NodeId"))
            if node is None or get(write, "AttributeId") != AttributeIds.Value:
                code = self._refusal(write)
                results[place] = status(code)
                self._reject(identity, write, code)
                continue
            owner, _, leaf = node.point.name.rpartition("/")
            if node.bit is not None:
                leaf = f"{leaf}.{node.bit}"
            target = owner.rpartition("/")[0]
            telegram = latest.get(target)
            if node.point.write is not WriteKind.TELEGRAM:
                telegram = _Telegram(target, COMMAND_OF[node.point.write])
                telegrams.append(telegram)
            # The same point twice is two telegrams: the edge between the two values may matter.
            elif telegram is None or leaf in telegram.values:
                telegram = latest[target] = _Telegram(target, Write)
                telegrams.append(telegram)
            telegram.places.append(place)
            try:
                telegram.values[leaf] = _value(node, write)
            except ServiceError as error:
                telegram.fault = telegram.fault or int(error.code)
                telegram.misfits |= _shown(leaf, write)
        by_drive: dict[str, list[_Telegram]] = {}
        for telegram in telegrams:
            by_drive.setdefault(telegram.target, []).append(telegram)
        await asyncio.gather(*(self._send(identity, one, results, explain) for one in by_drive.values()))
        return results

    async def _send(
        self,
        identity: Identity,
        telegrams: Sequence[_Telegram],
        results: list[ua.StatusCode],
        explain: Explain,
    ) -> None:
        """Send the telegrams of one drive, one after the other."""
        for telegram in telegrams:
            # One bad value refuses the others, too: there is no half a telegram.
            code = status(telegram.fault)
            if code.is_good():
                request = Request(identity, telegram.target, telegram.command())
                outcome = await ask(self._view, request)
                code = outcome_status(outcome)
                if not outcome.ok:
                    why = explanation(outcome)
                    for place in telegram.places:
                        explain(place, why)
            else:
                values = telegram.values | telegram.misfits
                told = rejection(identity, telegram.target, telegram.kind.action, code.value, values)
                self._view.rejected(told)
            for place in telegram.places:
                results[place] = code

    def _reject(self, identity: Identity, write: ua.WriteValue, code: int) -> None:
        """Report a write that addresses no command point."""
        name = str(get(write, "NodeId").Identifier)
        node_name, _, rest = name.partition("/")
        drive, _, point = rest.partition("/")
        target, leaf = (f"{node_name}/{drive}", point.rpartition("/")[2]) if point else (name, "")
        self._view.rejected(rejection(identity, target, Action.WRITE, code, _shown(leaf, write)))

    def _refusal(self, write: ua.WriteValue) -> int:
        """Status code for a write that no user may make."""
        node = self._space.get(get(write, "NodeId"))
        if node is None:
            return StatusCodes.BadNodeIdUnknown
        if get(write, "AttributeId") not in node.attributes:
            return StatusCodes.BadAttributeIdInvalid
        return StatusCodes.BadNotWritable


def _shown(leaf: str, write: ua.WriteValue) -> dict[str, Value]:
    """The written value by point name; empty where it is not a single value."""
    written: ua.DataValue = get(write, "Value")
    try:
        return {} if written.Value is None else {leaf: plain_value(written.Value)}
    except TypeError:
        return {}


def _value(node: VariableNode, write: ua.WriteValue) -> Value:
    """The value to ask for. Raises ServiceError.

    A client's source time is let go: it is not stored, and asyncua's own client sends one with every
    plain write. A status other than Good and a server time are refused (Part 4 §5.11.4).
    """
    written: ua.DataValue = get(write, "Value")
    code = written.StatusCode
    is_timed = written.ServerTimestamp or written.ServerPicoseconds
    if get(write, "IndexRange") or is_timed or (code is not None and code.value != StatusCodes.Good):
        raise ServiceError(StatusCodes.BadWriteNotSupported)
    if written.Value is None:
        raise ServiceError(StatusCodes.BadTypeMismatch)
    try:
        if node.bit is not None:
            return _bit(node, written.Value)
        return point_value(node.point, written.Value)
    except TypeError:
        raise ServiceError(StatusCodes.BadTypeMismatch) from None
    except ValueError:
        raise ServiceError(StatusCodes.BadOutOfRange) from None


def _bit(node: VariableNode, written: ua.Variant) -> bool:
    """Raises TypeError for anything but true and false."""
    if written.VariantType is not ua.VariantType.Boolean or not isinstance(written.Value, bool):
        raise TypeError(f"{node.id} takes true or false")
    return written.Value
