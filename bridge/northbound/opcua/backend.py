"""The bridge behind the OPC UA server: its users, and what they write and call."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial

from bridge.base import clock
from bridge.command.messages.freshness import Inflow
from bridge.command.messages.request import Role
from bridge.northbound.opcua.accounts import Accounts
from bridge.northbound.opcua.alarms.alarm_rights import LEAST_ROLE
from bridge.northbound.opcua.certificates.server_configuration import ServerConfiguration
from bridge.northbound.opcua.history.file_transfer import READING, FileTransfer, file_method
from bridge.northbound.opcua.history.plant_history import PlantHistory
from bridge.northbound.opcua.requests.methods import Caller
from bridge.northbound.opcua.requests.read_through import ReadThrough
from bridge.northbound.opcua.requests.session_user import SessionUser
from bridge.northbound.opcua.requests.writes import Writer
from bridge.northbound.opcua.space.permissions import ROLE_NODES
from bridge.northbound.pulse import Pulse
from bridge.northbound.view import View
from bridge.uaserver.application import LoginAttempt, ServedApplication
from bridge.uaserver.conditions.calls import METHODS
from bridge.uaserver.explanations import Explain, Explanation
from bridge.uaserver.history.history import EventHistory, ValueHistory
from bridge.uaserver.library import get, node_id, ua


class ConnectionArrivals:
    """Times of what comes through one connection."""

    def __init__(self, pulse: Pulse) -> None:
        self._pulse = pulse
        self._inflow = Inflow(clock.now(), pulse.look)

    def arrive(self, *, crowded: bool) -> float:
        return self._inflow.arrive(clock.now(), self._pulse.look, crowded=crowded)


class Backend(ServedApplication[SessionUser]):
    """Users, writes and calls of the server's sessions, and what they read of the past. ``least_role`` is
    that of the tree, ``pulse`` that of the event loop."""

    def __init__(
        self,
        users: Accounts,
        least_role: Callable[[ua.NodeId], Role | None],
        reader: ReadThrough,
        writer: Writer,
        caller: Caller,
        configuration: ServerConfiguration,
        view: View,
        pulse: Pulse,
        past: PlantHistory,
    ) -> None:
        self._users = users
        self._least_role = least_role
        self._reader = reader
        self._writer = writer
        self._caller = caller
        self._configuration = configuration
        self._view = view
        self._pulse = pulse
        self._past = past
        self._transfer = FileTransfer(past.files)

    async def identify(self, login: LoginAttempt) -> SessionUser:
        identity = await self._users.identify(login)
        return SessionUser(replace(identity, connection=login.session), login.encrypted)

    @property
    def highest_rank(self) -> int:
        return int(self._users.highest_role)

    def may(self, user: SessionUser, where: ua.NodeId) -> bool:
        if where in READING:
            return True
        if self._configuration.has(where):
            return user.encrypted and user.identity.role >= Role.ADMIN
        least = self._least_role(where)
        if least is None and where in METHODS:
            least = LEAST_ROLE.get(METHODS[where].name, Role.OBSERVER)
        return user.identity.role >= (Role.OPERATOR if least is None else least)

    def roles(self, user: SessionUser) -> Sequence[ua.NodeId]:
        return [node_id(where) for where in ROLE_NODES[user.identity.role]]

    def may_diagnose(self, user: SessionUser) -> bool:
        return user.identity.role >= Role.ENGINEER

    def refreshable(self, nodes: Iterable[ua.NodeId]) -> Sequence[ua.NodeId]:
        return self._reader.wanted(nodes)

    async def refresh(
        self, user: SessionUser, nodes: Sequence[ua.NodeId]
    ) -> Mapping[ua.NodeId, tuple[ua.StatusCode, Explanation]]:
        return await self._reader.read(user.identity, nodes)

    async def write(
        self, user: SessionUser, writes: Sequence[ua.WriteValue], explain: Explain
    ) -> list[ua.StatusCode]:
        return await self._writer.write(user.identity, writes, explain)

    async def call(
        self, user: SessionUser, calls: Sequence[ua.CallMethodRequest], explain: Explain
    ) -> list[ua.CallMethodResult]:
        return list(
            await asyncio.gather(
                *(self._call(user, call, partial(explain, place)) for place, call in enumerate(calls))
            )
        )

    async def _call(
        self, user: SessionUser, call: ua.CallMethodRequest, explain: Callable[[Explanation], None]
    ) -> ua.CallMethodResult:
        if self._configuration.has(get(call, "MethodId")):
            return await self._configuration.call(user.identity, call, encrypted=user.encrypted)
        method, file = file_method(call), self._past.file(get(call, "ObjectId"))
        if method and file:
            given: list[ua.Variant] = get(call, "InputArguments") or []
            return await self._transfer.call(user.identity.connection, file, method, given)
        (result,) = await self._caller.call(user.identity, [call], lambda _, why: explain(why))
        return result

    def value_history(self, where: ua.NodeId) -> ValueHistory | None:
        return self._past.value_history(where)

    def event_history(self, where: ua.NodeId) -> EventHistory | None:
        return self._past.event_history(where)

    def on_connection(self, user: SessionUser, *, is_there: bool, has_others: bool) -> None:
        if not is_there:
            self._transfer.leave(user.identity.connection)
            self._configuration.leave(user.identity.connection)
        self._view.on_connection(user.identity, is_there=is_there, has_others=has_others)

    def on_refused(self) -> None:
        self._view.count("opcua_refused_connections")

    def on_broken(self) -> None:
        self._view.count("opcua_broken_connections")

    def arrivals(self) -> ConnectionArrivals:
        return ConnectionArrivals(self._pulse)
