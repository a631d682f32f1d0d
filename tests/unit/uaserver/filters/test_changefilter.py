"""Filters of changes, on the standard's own types; no server."""

from __future__ import annotations

import pytest
from asyncua import ua
from asyncua.server.address_space import AddressSpace

from bridge.uaserver.filters.changefilter import change_filter
from bridge.uaserver.library import DataChangeFilter, ServiceError
from tests.support.opcua_filters import (
    asked,
)

Codes, Ids, Kind, Op = ua.StatusCodes, ua.ObjectIds, ua.VariantType, ua.FilterOperator


@pytest.mark.landing(8)
@pytest.mark.parametrize(
    ("wrong", "attribute", "code"),
    [
        (DataChangeFilter(), ua.AttributeIds.DisplayName, Codes.BadFilterNotAllowed),
        (asked(), ua.AttributeIds.Value, Codes.BadFilterNotAllowed),
        (ua.AggregateFilter(), ua.AttributeIds.Value, Codes.BadMonitoredItemFilterUnsupported),
        (
            ua.ExtensionObject(TypeId=ua.NodeId(9, 3)),
            ua.AttributeIds.Value,
            Codes.BadMonitoredItemFilterUnsupported,
        ),
        (DataChangeFilter(DeadbandType=3), ua.AttributeIds.Value, Codes.BadDeadbandFilterInvalid),
        (
            DataChangeFilter(DeadbandType=1, DeadbandValue=-1),
            ua.AttributeIds.Value,
            Codes.BadDeadbandFilterInvalid,
        ),
        (
            DataChangeFilter(DeadbandType=1, DeadbandValue=float("nan")),
            ua.AttributeIds.Value,
            Codes.BadDeadbandFilterInvalid,
        ),
        # Without an EURange there is nothing to take a part of.
        (
            DataChangeFilter(DeadbandType=2, DeadbandValue=5),
            ua.AttributeIds.Value,
            Codes.BadDeadbandFilterInvalid,
        ),
    ],
)
def test_a_filter_that_an_item_cannot_have_is_refused(
    space: AddressSpace, wrong: object, attribute: int, code: int
) -> None:
    node = space[ua.NodeId(Ids.Server_ServiceLevel)]
    with pytest.raises(ServiceError) as refused:
        change_filter(wrong, space, node, attribute)
    assert refused.value.code == code


def test_a_deadband_is_for_numbers(space: AddressSpace) -> None:
    wanted = DataChangeFilter(DeadbandType=1, DeadbandValue=1)
    for name in (Ids.Server_ServiceLevel, Ids.Server_ServerStatus_SecondsTillShutdown):
        assert change_filter(wanted, space, space[ua.NodeId(name)], ua.AttributeIds.Value).deadband == 1
    for name in (
        Ids.Server_ServerStatus_CurrentTime,
        Ids.Server_NamespaceArray,
        Ids.Server_ServerStatus_State,
    ):
        with pytest.raises(ServiceError) as refused:
            change_filter(wanted, space, space[ua.NodeId(name)], ua.AttributeIds.Value)
        assert refused.value.code == Codes.BadFilterNotAllowed
