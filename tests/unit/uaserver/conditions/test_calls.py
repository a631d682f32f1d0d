"""Arguments of the methods of conditions: what is taken, and what is said of all else."""

from __future__ import annotations

import pytest
from asyncua import ua
from asyncua.server.address_space import AddressSpace
from hypothesis import given
from hypothesis import strategies as st

from bridge.uaserver.conditions.calls import (
    LONGEST_COMMENT,
    METHODS,
    ArgumentFault,
    ArgumentKind,
    ConditionMethod,
    arguments,
)

Codes, Kind = ua.StatusCodes, ua.VariantType
BY_EVENT = ConditionMethod("AddComment", (ArgumentKind.EVENT_ID, ArgumentKind.COMMENT))
TIMED = ConditionMethod("TimedShelve", (ArgumentKind.SHELVING_TIME,))
ID = ua.Variant(b"x", Kind.ByteString)
SAID = ua.Variant(ua.LocalizedText("gesehen", "de"), Kind.LocalizedText)


def test_each_method_is_one_of_the_standards_with_its_arguments(space: AddressSpace) -> None:
    missing = {where for where in METHODS if where not in space}
    # asyncua has these with their type alone.
    below = ua.ObjectIds.AlarmConditionType_ShelvingState_TimedShelve2, 24740, 24742
    assert missing == {ua.NodeId(number) for number in below}
    for where, method in METHODS.items():
        if where in missing:
            continue
        name = space.read_attribute_value(where, ua.AttributeIds.BrowseName).Value
        assert name is not None
        assert name.Value.Name.removesuffix("2") == method.name.removesuffix("2")
        properties = [
            one.NodeId for one in space[where].references if one.BrowseName.Name == "InputArguments"
        ]
        described = [space.read_attribute_value(one, ua.AttributeIds.Value).Value for one in properties]
        names = [one.Name for value in described if value for one in value.Value]
        assert names == [kind.value for kind in method.arguments], method


def test_the_arguments_are_found_by_what_they_are() -> None:
    assert arguments(BY_EVENT, [ID, SAID]) == {
        ArgumentKind.EVENT_ID: b"x",
        ArgumentKind.COMMENT: ua.LocalizedText("gesehen", "de"),
    }
    assert arguments(TIMED, [ua.Variant(60, Kind.UInt32)]) == {ArgumentKind.SHELVING_TIME: 60}


@pytest.mark.parametrize(
    ("given_", "code", "faults"),
    [
        ([], Codes.BadArgumentsMissing, ()),
        ([ID, SAID, SAID], Codes.BadTooManyArguments, ()),
        ([SAID, SAID], Codes.BadInvalidArgument, [Codes.BadTypeMismatch, Codes.Good]),
        ([ID, ua.Variant("x")], Codes.BadInvalidArgument, [Codes.Good, Codes.BadTypeMismatch]),
        ([ua.Variant([b"x"]), SAID], Codes.BadInvalidArgument, [Codes.BadTypeMismatch, Codes.Good]),
        ([ua.Variant(bytes(101)), SAID], Codes.BadInvalidArgument, [Codes.BadOutOfRange, Codes.Good]),
        (
            [ID, ua.Variant(ua.LocalizedText("x" * (LONGEST_COMMENT + 1), "de"))],
            Codes.BadInvalidArgument,
            [Codes.Good, Codes.BadOutOfRange],
        ),
        (
            [ID, ua.Variant(ua.LocalizedText("x", "d" * 51))],
            Codes.BadInvalidArgument,
            [Codes.Good, Codes.BadOutOfRange],
        ),
    ],
)
def test_each_argument_is_told_what_is_wrong_with_it(
    given_: list[ua.Variant], code: int, faults: list[int]
) -> None:
    with pytest.raises(ArgumentFault) as refused:
        arguments(BY_EVENT, given_)
    assert (refused.value.code, list(refused.value.faults)) == (code, list(faults))


ANY = st.one_of(
    st.integers(-(2**31), 2**31 - 1).map(lambda value: ua.Variant(value, Kind.Int32)),
    st.floats().map(lambda value: ua.Variant(value, Kind.Double)),
    st.text(max_size=5).map(ua.Variant),
    st.binary(max_size=5).map(ua.Variant),
    st.just(ua.Variant(None)),
    st.just(SAID),
    st.lists(st.integers(0, 9), min_size=1).map(ua.Variant),
)


@given(st.sampled_from(list(METHODS.values())), st.lists(ANY, max_size=3))
def test_whatever_comes_is_taken_or_refused(method: ConditionMethod, given_: list[ua.Variant]) -> None:
    try:
        assert len(arguments(method, given_)) == len(method.arguments)
    except ArgumentFault as refused:
        assert refused.code
