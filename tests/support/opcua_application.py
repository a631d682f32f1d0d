"""An application that an OPC UA server serves in tests: users without passwords, and variables."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Iterable, Sequence
from dataclasses import dataclass, field

from asyncua import ua
from asyncua.server.address_space import AddressSpace, AttributeValue, NodeData

from bridge.uaserver.application import LoginAttempt, ServedApplication
from bridge.uaserver.explanations import Explain, Explanation
from bridge.uaserver.history.history import EventHistory, ValueHistory
from bridge.uaserver.library import ServiceError

Ids = ua.AttributeIds


@dataclass(frozen=True)
class User:
    name: str
    has_rights: bool = True
    is_anonymous: bool = False

    @property
    def rank(self) -> int:
        return int(self.has_rights)

    def is_same(self, other: object) -> bool:
        return self == other


class AtOnce:
    """Arrivals of requests that have never waited."""

    def arrive(self, *, crowded: bool) -> float:
        return 0.0


@dataclass
class Served(ServedApplication[User]):
    """``users`` by their names; ``told`` is who came and went, and whether there were others."""

    users: dict[str, User] = field(default_factory=dict)
    told: list[tuple[str, bool, bool]] = field(default_factory=list)
    written: list[tuple[str, object]] = field(default_factory=list)
    refused: dict[ua.NodeId, tuple[ua.StatusCode, Explanation]] = field(default_factory=dict)
    """Nodes that cannot be brought from where they come from, and why."""
    before_refresh: Callable[[], Awaitable[None]] = lambda: asyncio.sleep(0)
    refusals: int = 0
    broken: int = 0
    after_write: Callable[[], None] = lambda: None

    async def identify(self, login: LoginAttempt) -> User:
        name = getattr(login.token, "UserName", None) or "anonymous"
        if name not in self.users:
            raise ServiceError(ua.StatusCodes.BadUserAccessDenied)
        return self.users[name]

    @property
    def highest_rank(self) -> int:
        return max((user.rank for user in self.users.values()), default=0)

    def may(self, user: User, where: ua.NodeId) -> bool:
        return user.has_rights

    def roles(self, user: User) -> Sequence[ua.NodeId]:
        return [ua.NodeId(ua.ObjectIds.WellKnownRole_Operator)] if user.has_rights else []

    def may_diagnose(self, user: User) -> bool:
        return user.name == "engineer"

    def refreshable(self, nodes: Iterable[ua.NodeId]) -> list[ua.NodeId]:
        return [where for where in nodes if where in self.refused]

    async def refresh(
        self, user: User, nodes: Sequence[ua.NodeId]
    ) -> dict[ua.NodeId, tuple[ua.StatusCode, Explanation]]:
        await self.before_refresh()
        return {where: self.refused[where] for where in nodes}

    async def write(
        self, user: User, writes: Sequence[ua.WriteValue], explain: Explain
    ) -> list[ua.StatusCode]:
        self.written += [(user.name, one.Value.Value.Value) for one in writes]
        self.after_write()
        return [ua.StatusCode() for _ in writes]

    async def call(
        self, user: User, calls: Sequence[ua.CallMethodRequest], explain: Explain
    ) -> list[ua.CallMethodResult]:
        return [ua.CallMethodResult() for _ in calls]

    def value_history(self, where: ua.NodeId) -> ValueHistory | None:
        return None

    def event_history(self, where: ua.NodeId) -> EventHistory | None:
        return None

    def on_connection(self, user: User, *, is_there: bool, has_others: bool) -> None:
        self.told.append((user.name, is_there, has_others))

    def on_refused(self) -> None:
        self.refusals += 1

    def on_broken(self) -> None:
        self.broken += 1

    def arrivals(self) -> AtOnce:
        return AtOnce()


def add_variable(space: AddressSpace, where: ua.NodeId, value: int, access: int = 1) -> None:
    """A UInt16 with nothing around it."""

    def held(content: object, kind: ua.VariantType) -> AttributeValue:
        return AttributeValue(ua.DataValue(ua.Variant(content, kind)))

    kinds = ua.VariantType
    node = NodeData(where)
    node.attributes = {
        Ids.NodeId: held(where, kinds.NodeId),
        Ids.NodeClass: held(ua.NodeClass.Variable, kinds.Int32),
        Ids.BrowseName: held(ua.QualifiedName(str(where.Identifier), 1), kinds.QualifiedName),
        Ids.Value: held(value, kinds.UInt16),
        Ids.DataType: held(ua.NodeId(ua.ObjectIds.UInt16), kinds.NodeId),
        Ids.ValueRank: held(-1, kinds.Int32),
        Ids.AccessLevel: held(access, kinds.Byte),
        Ids.UserAccessLevel: held(access, kinds.Byte),
    }
    space[where] = node
