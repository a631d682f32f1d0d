"""The subscriptions of all clients; no server, no clock."""

from __future__ import annotations

import pytest
from asyncua import ua
from asyncua.server.address_space import AddressSpace

from bridge.uaserver.library import ServiceError
from bridge.uaserver.subscriptions.quotas import MOST_SUBSCRIPTIONS
from bridge.uaserver.subscriptions.subscriptions import Subscriptions
from tests.support.opcua_sessions import Session, User

Codes, Mode = ua.StatusCodes, ua.MonitoringMode


async def test_who_was_left_behind_makes_room_and_nobody_else() -> None:
    there = Subscriptions(AddressSpace())
    left, busy, params = (
        Session(),
        Session(),
        ua.CreateSubscriptionParameters(RequestedPublishingInterval=1e6),
    )
    for number in range(MOST_SUBSCRIPTIONS):
        there.create(left if number < 2 else busy, params)
    await there.end(left, delete=False)
    left.is_gone = True
    for _ in range(2):
        await there.drop_left_behind()
        there.create(busy, params)
    assert there.of(left) == []
    await there.drop_left_behind()
    with pytest.raises(ServiceError) as refused:
        there.create(busy, params)
    assert refused.value.code == Codes.BadTooManySubscriptions
    await there.end(busy, delete=True)
    assert there.subscriptions == {}


@pytest.mark.parametrize(
    ("user", "certificate", "stays"), [("anna", None, 1), ("anonymous", b"x", 1), ("anonymous", None, 0)]
)
async def test_what_nobody_could_take_over_is_not_left_behind(
    user: str, certificate: bytes | None, stays: int
) -> None:
    there = Subscriptions(AddressSpace())
    owner = Session(identity=User(user), channel_certificate=certificate)
    there.create(owner, ua.CreateSubscriptionParameters(RequestedPublishingInterval=1e6))
    await there.end(owner, delete=False)
    assert len(there.subscriptions) == stays
    await there.end(owner, delete=True)
