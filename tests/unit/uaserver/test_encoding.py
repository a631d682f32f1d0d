"""Results that are encoded as they come: the same bytes, in turns, and no more than may be."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from asyncua import ua
from asyncua.ua.ua_binary import struct_to_binary

from bridge.uaserver.encoding import Results, encode, weight
from bridge.uaserver.library import ServiceError

ANY_SIZE = 1 << 24
VALUES = [
    ua.DataValue(ua.Variant(7, ua.VariantType.UInt16)),
    ua.DataValue(ua.Variant(["off", "on"], ua.VariantType.String)),
    ua.DataValue(ua.Variant(None, ua.VariantType.Null), ua.StatusCode(ua.StatusCodes.BadNodeIdUnknown)),
]
BROWSED = [
    ua.BrowseResult(ContinuationPoint=b"12345678", References=[ua.ReferenceDescription()] * 3),
    ua.BrowseResult(StatusCode=ua.StatusCode(ua.StatusCodes.BadNodeIdUnknown)),
]


@pytest.mark.parametrize(
    ("kind", "found"),
    [(ua.ReadResponse, VALUES), (ua.ReadResponse, []), (ua.BrowseResponse, BROWSED)],
)
async def test_the_bytes_are_those_of_a_response_that_is_encoded_in_one_go(
    kind: type, found: list[Any]
) -> None:
    results = Results(ANY_SIZE)
    for one in found:
        await results.add(one)
    whole, in_turns = kind(), kind()
    whole.Results, in_turns.Results = found, results
    in_turns.ResponseHeader = whole.ResponseHeader
    assert encode(in_turns) == struct_to_binary(whole)


async def test_what_is_no_list_of_results_is_encoded_as_it_is() -> None:
    for response in (ua.ServiceFault(), ua.WriteResponse(Results=[ua.StatusCode()])):
        assert encode(response) == struct_to_binary(response)


async def test_more_than_the_client_takes_is_refused_when_it_is_added() -> None:
    one = ua.DataValue(ua.Variant(bytes(1000), ua.VariantType.ByteString))
    results = Results(3 * len(struct_to_binary(one)))
    for _ in range(3):
        await results.add(one)
    with pytest.raises(ServiceError) as refused:
        await results.add(one)
    assert refused.value.code == ua.StatusCodes.BadResponseTooLarge
    assert results.count == 3


@pytest.mark.parametrize("found", [VALUES[0], VALUES[2], BROWSED[0]], ids=["a value", "a code", "references"])
async def test_others_have_their_turn_meanwhile(found: Any) -> None:
    turns = 0

    async def count() -> None:
        nonlocal turns
        while True:
            turns += 1
            await asyncio.sleep(0)

    other = asyncio.create_task(count())
    results = Results(ANY_SIZE)
    for _ in range(5_000):
        await results.add(found)
    other.cancel()
    assert turns >= 5_000 // 600


@pytest.mark.parametrize("value", [*VALUES, ua.DataValue(ua.Variant(bytes(5000), ua.VariantType.ByteString))])
def test_a_value_weighs_what_it_takes_at_least(value: ua.DataValue) -> None:
    assert len(struct_to_binary(value)) <= weight(value.Value) <= 3 * len(struct_to_binary(value)) + 100
