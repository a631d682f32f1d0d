"""The decoder, made strict."""

from __future__ import annotations

import asyncio
import struct

import pytest
from asyncua import ua
from asyncua.common.utils import Buffer, NotEnoughData
from asyncua.ua.ua_binary import struct_from_binary, struct_to_binary, variant_from_binary, variant_to_binary
from hypothesis import given
from hypothesis import strategies as st

from bridge.uaserver import decoding
from bridge.uaserver.library import UaError, UaStatusCodeError


@pytest.fixture(autouse=True)
def strict() -> None:
    decoding.install()
    decoding.install()
    decoding.begin(decoding.MOST_ELEMENTS)


def reads(count: int) -> bytes:
    return struct_to_binary(ua.ReadParameters(NodesToRead=[ua.ReadValueId() for _ in range(count)]))


def test_what_is_sound_is_decoded_as_before() -> None:
    params = struct_from_binary(ua.ReadParameters, Buffer(reads(3)))
    assert len(params.NodesToRead) == 3
    for value in ("Grüße", b"\xff", [1, 2], None, 7):
        assert variant_from_binary(Buffer(variant_to_binary(ua.Variant(value)))).Value == value


def test_a_string_that_is_no_utf_8_is_refused_and_known_as_malformed() -> None:
    content = struct_to_binary(ua.QualifiedName("ab")).replace(b"ab", b"\xff\xfe")
    with pytest.raises(UnicodeDecodeError) as refused:
        struct_from_binary(ua.QualifiedName, Buffer(content))
    assert decoding.is_malformed(refused.value)
    assert decoding.place(refused.value).startswith("at decoding.py:")


@pytest.mark.parametrize("length", [2**31 - 1, 1000, -2])
def test_an_array_is_no_longer_than_its_message(length: int) -> None:
    content = reads(1).replace(struct.pack("<i", 1), struct.pack("<i", length), 1)
    with pytest.raises(NotEnoughData) as refused:
        struct_from_binary(ua.ReadParameters, Buffer(content))
    assert decoding.is_malformed(refused.value)


def test_the_elements_of_a_message_are_counted() -> None:
    decoding.begin(10)
    struct_from_binary(ua.ReadParameters, Buffer(reads(6)))
    with pytest.raises(UaStatusCodeError) as refused:
        struct_from_binary(ua.ReadParameters, Buffer(reads(6)))
    assert refused.value.code == ua.StatusCodes.BadEncodingLimitsExceeded
    decoding.begin(10)
    struct_from_binary(ua.ReadParameters, Buffer(reads(6)))


def test_what_is_decoded_at_once_is_short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Others wait meanwhile."""
    monkeypatch.setattr(decoding, "MOST_AT_ONCE", 5)
    decoding.begin(100)
    struct_from_binary(ua.ReadParameters, Buffer(reads(5)))
    with pytest.raises(UaStatusCodeError) as refused:
        struct_from_binary(ua.ReadParameters, Buffer(reads(1)))
    assert refused.value.code == ua.StatusCodes.BadEncodingLimitsExceeded


@pytest.mark.parametrize(("elements", "parts", "is_taken"), [(20, 4, True), (1, 6, False), (20, 6, False)])
async def test_an_element_that_is_decoded_in_its_turn_is_short(
    monkeypatch: pytest.MonkeyPatch, elements: int, parts: int, is_taken: bool
) -> None:
    monkeypatch.setattr(decoding, "MOST_AT_ONCE", 5)
    path = ua.BrowsePath(RelativePath=ua.RelativePath([ua.RelativePathElement()] * parts))
    params = ua.TranslateBrowsePathsToNodeIdsParameters([path] * elements)
    content = Buffer(struct_to_binary(params))
    decoding.begin(200)
    decode = decoding.decoded(ua.TranslateBrowsePathsToNodeIdsParameters, ("BrowsePaths",), content)
    if is_taken:
        assert await decode == params
    else:
        with pytest.raises(UaStatusCodeError):
            await decode


@pytest.mark.parametrize("size", [-1, 4])
def test_a_buffer_gives_what_it_has(size: int) -> None:
    with pytest.raises(NotEnoughData):
        Buffer(b"abc").read(size)
    assert Buffer(b"abc").read(3) == b"abc"


def test_dimensions_fit_the_values() -> None:
    sound = ua.Variant([1, 2, 3, 4], ua.VariantType.Int32, Dimensions=[2, 2])
    content = variant_to_binary(sound)
    assert variant_from_binary(Buffer(content)).Value == [[1, 2], [3, 4]]
    wrong = content[: -struct.calcsize("<ii")] + struct.pack("<ii", 2, 3)
    with pytest.raises(UaError):
        variant_from_binary(Buffer(wrong))


def test_what_fails_elsewhere_is_not_malformed() -> None:
    try:
        raise ValueError("x")
    except ValueError as error:
        assert not decoding.is_malformed(error)
    assert decoding.place(ValueError("never raised")) == ""


# in turns


@given(
    st.lists(st.integers(0, 2**32 - 1), max_size=20),
    st.lists(st.integers(0, 2**32 - 1), max_size=20),
    st.integers(0, 2**32 - 1),
)
def test_what_is_decoded_in_turns_is_the_same(add: list[int], remove: list[int], number: int) -> None:
    params = ua.SetTriggeringParameters(number, number, add, remove)
    content = struct_to_binary(params)
    arrays = ("LinksToAdd", "LinksToRemove")
    decoding.begin(decoding.MOST_ELEMENTS)
    found = asyncio.run(decoding.decoded(ua.SetTriggeringParameters, arrays, Buffer(content)))
    assert found == struct_from_binary(ua.SetTriggeringParameters, Buffer(content)) == params


async def test_structures_are_decoded_in_turns_too() -> None:
    found = await decoding.decoded(ua.ReadParameters, ("NodesToRead",), Buffer(reads(3)))
    assert found == struct_from_binary(ua.ReadParameters, Buffer(reads(3)))
    null = struct_to_binary(ua.ReadParameters())[: -struct.calcsize("<i")] + struct.pack("<i", -1)
    assert (await decoding.decoded(ua.ReadParameters, ("NodesToRead",), Buffer(null))).NodesToRead == []


@pytest.mark.parametrize("length", [2**31 - 1, 1000, -2])
async def test_in_turns_an_array_is_no_longer_than_its_message(length: int) -> None:
    content = reads(0)[: -struct.calcsize("<i")] + struct.pack("<i", length)
    with pytest.raises(NotEnoughData) as refused:
        await decoding.decoded(ua.ReadParameters, ("NodesToRead",), Buffer(content))
    assert decoding.is_malformed(refused.value)


async def test_in_turns_no_more_is_decoded_than_the_budget_has() -> None:
    decoding.begin(2)
    with pytest.raises(UaStatusCodeError):
        await decoding.decoded(ua.ReadParameters, ("NodesToRead",), Buffer(reads(3)))


async def test_what_is_cut_off_in_an_element_is_malformed() -> None:
    with pytest.raises(NotEnoughData) as refused:
        await decoding.decoded(ua.ReadParameters, ("NodesToRead",), Buffer(reads(3)[:-1]))
    assert decoding.is_malformed(refused.value)


@pytest.mark.parametrize(("length", "known"), [(3, 3), (0, 0), (-1, 0)])
def test_the_length_of_an_array_is_known_before_it_is_decoded(length: int, known: int) -> None:
    data = Buffer(struct.pack("<i", length))
    assert decoding.first_length(data) == known
    assert len(data) == struct.calcsize("<i")
