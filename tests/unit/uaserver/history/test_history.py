"""Raw and interpolated reads (OPC 10000-11 §6.4.3 and §6.4.5), with the examples of its tables; no server."""

from __future__ import annotations

from datetime import UTC, datetime
from types import SimpleNamespace

import pytest
from asyncua import ua
from hypothesis import given
from hypothesis import strategies as st

from bridge.uaserver.history.history import Bound, Rest, date_time, raw, spanned, time_us, value_at, value_of
from bridge.uaserver.library import ServiceError
from tests.support.opcua_history import Samples, sample

Codes = ua.StatusCodes
LATER = 10**15


def at(clock: str) -> int:
    """5:02 as µs."""
    hours, minutes = clock.split(":")
    return (int(hours) * 60 + int(minutes)) * 60_000_000


FIVE = Samples([sample(at(f"5:0{minute}"), float(minute)) for minute in (0, 2, 3, 5, 6)])


def seen(rest: Rest, kept: Samples = FIVE, most: int = 1000) -> list[str]:
    """Times of what is read, with an exclamation mark where there is no bound."""
    found = [value_of(kept, one) for one in rest.take(most)[0]]
    return [
        f"{one.SourceTimestamp:%-H:%M}" + "!" * (one.StatusCode.value == Codes.BadBoundNotFound)
        for one in found
    ]


@pytest.mark.landing(14)
@pytest.mark.parametrize(
    ("start", "end", "bounds", "expected"),
    [
        ("5:00", "5:05", True, "5:00 5:02 5:03 5:05"),
        ("5:00", "5:05", False, "5:00 5:02 5:03"),
        ("5:01", "5:04", True, "5:00 5:02 5:03 5:05"),
        ("5:01", "5:04", False, "5:02 5:03"),
        ("5:05", "5:00", True, "5:05 5:03 5:02 5:00"),
        ("5:05", "5:00", False, "5:05 5:03 5:02"),
        ("5:04", "5:01", True, "5:05 5:03 5:02 5:00"),
        ("5:04", "5:01", False, "5:03 5:02"),
        ("4:59", "5:05", True, "4:59! 5:00 5:02 5:03 5:05"),
        ("5:01", "5:07", True, "5:00 5:02 5:03 5:05 5:06 5:07!"),
        ("5:07", "5:05", True, "5:07! 5:06 5:05"),
        ("5:00", "4:59", True, "5:00 4:59!"),
        ("5:07", "5:08", True, "5:06 5:08!"),
        ("5:07", "5:08", False, ""),
        ("4:00", "4:30", True, "4:00! 5:00"),
        ("4:00", "4:30", False, ""),
        ("5:00", None, False, "5:00 5:02 5:03 5:05 5:06"),
        ("5:00", None, True, "5:00 5:02 5:03 5:05 5:06 5:06!"),
        ("5:07", None, True, "5:06 5:07!"),
        (None, "5:05", False, "5:05 5:03 5:02 5:00"),
        (None, "5:04", True, "5:05 5:03 5:02 5:00 4:59!"),
        ("5:02", "5:02", False, "5:02"),
        ("5:02", "5:02", True, "5:02"),
        ("5:01", "5:01", False, ""),
        ("5:01", "5:01", True, "5:00 5:02"),
    ],
)
def test_raw_reads_are_those_of_the_standard(
    start: str | None, end: str | None, bounds: bool, expected: str
) -> None:
    rest = raw(FIVE, start and at(start), end and at(end), bounds=bounds)
    assert seen(rest) == expected.split()


def test_a_bound_without_a_time_of_its_own_is_a_second_off() -> None:
    (*_, last), _ = raw(FIVE, at("5:00"), None, bounds=True).take(100)
    assert last == Bound(at("5:06") + 1_000_000)
    (*_, last), _ = raw(FIVE, None, at("5:04"), bounds=True).take(100)
    assert last == Bound(at("5:00") - 1_000_000)


@pytest.mark.parametrize("bounds", [False, True])
def test_of_nothing_nothing_is_read(bounds: bool) -> None:
    expected = ["5:00!", "5:05!"] if bounds else []
    assert seen(raw(Samples([]), at("5:00"), at("5:05"), bounds=bounds), Samples([])) == expected


TIMES = st.lists(st.integers(0, 40), unique=True, max_size=25).map(sorted)
SPAN = st.tuples(st.integers(-5, 45), st.integers(-5, 45)).filter(lambda span: span[0] != span[1])


def samples(times: list[int], first: int) -> Samples:
    return Samples([sample(time, time) for time in times], first)


def whole(rest: Rest) -> list[int | Bound]:
    return rest.take(10_000)[0]


@given(TIMES, st.integers(0, 10**6), SPAN, st.integers(1, 7), st.booleans())
def test_what_is_read_in_pieces_is_the_whole(
    times: list[int], first: int, span: tuple[int, int], most: int, bounds: bool
) -> None:
    rest = raw(samples(times, first), *span, bounds=bounds)
    expected = whole(rest)
    found: list[int | Bound] = []
    while not rest.is_empty:
        taken, rest = rest.take(most)
        assert 0 < len(taken) <= most
        found += taken
    assert found == expected


@given(TIMES, st.integers(0, 10**6), SPAN)
def test_backwards_is_forwards_reversed(times: list[int], first: int, span: tuple[int, int]) -> None:
    kept = samples(times, first)
    back = whole(raw(kept, span[1], span[0], bounds=True))
    assert whole(raw(kept, *span, bounds=True)) == back[::-1]


@given(TIMES, SPAN)
def test_a_read_has_what_lies_between_its_times(times: list[int], span: tuple[int, int]) -> None:
    kept = samples(times, 3)
    found = [kept.time_us(one) for one in whole(raw(kept, *span, bounds=False)) if isinstance(one, int)]
    start, end = span
    if start < end:
        assert found == [time for time in times if start <= time < end]
    else:
        assert found == [time for time in reversed(times) if end < time <= start]


def test_what_a_ring_has_forgotten_is_not_passed_over_in_silence() -> None:
    kept = samples(list(range(10)), 0)
    _, ahead = raw(kept, 0, 10, bounds=False).take(3)
    _, back = raw(kept, None, 9, bounds=False).take(3)
    kept.forget(3)
    assert ahead.within(kept) == ahead
    kept.forget(1)
    with pytest.raises(ServiceError) as error:
        ahead.within(kept)
    assert error.value.code == Codes.BadContinuationPointInvalid
    assert whole(back.within(kept)) == [6, 5, 4]


def test_two_of_start_end_and_number_say_what_is_meant() -> None:
    none = datetime(1601, 1, 1, tzinfo=UTC)
    some = date_time(5)

    def asked(start: datetime, end: datetime, number: int) -> tuple[int | None, int | None]:
        return spanned(SimpleNamespace(StartTime=start, EndTime=end, NumValuesPerNode=number))

    assert asked(some, some, 0) == (5, 5)
    assert asked(some, none, 1) == (5, None)
    assert asked(none, some, 1) == (None, 5)
    for few in ((none, none, 1), (some, none, 0), (none, some, 0), (none, none, 0)):
        with pytest.raises(ServiceError) as error:
            asked(*few)
        assert error.value.code == Codes.BadHistoryOperationInvalid


def test_times_are_exact_to_the_microsecond() -> None:
    for us in (0, 1, 1_795_976_400_123_457, 253_402_214_400_000_000 - 1):
        assert time_us(date_time(us)) == us
    naive = date_time(5).replace(tzinfo=None)
    assert time_us(naive) == 5
    assert date_time(10**30).year == 9999


# at times

GOOD, UNSURE = 0x0402, Codes.UncertainDataSubNormal | 0x0402
LOST = Codes.UncertainNoCommunicationLastUsableValue
RAMP = [
    sample(10, 1.0),
    sample(20, 3.0),
    sample(30, 5.0, LOST),
    sample(40, None, Codes.BadNoCommunication),
    sample(50, 9.0),
]


@pytest.mark.landing(8)
@pytest.mark.parametrize(
    ("time", "stepped", "simple", "value", "code"),
    [
        (20, True, True, 3.0, Codes.Good),
        (30, True, True, 5.0, LOST),
        (40, True, True, None, Codes.BadNoCommunication),
        (15, True, True, 1.0, GOOD),
        (15, False, True, 2.0, GOOD),
        (35, True, True, 5.0, UNSURE),
        (45, True, True, None, Codes.BadNoData),
        (45, True, False, 3.0, UNSURE),
        (25, False, True, 4.0, UNSURE),
        (35, False, True, 5.0, UNSURE),
        (35, False, False, 6.0, UNSURE),
        (55, True, True, 9.0, UNSURE),
        (55, False, True, 9.0, UNSURE),
        (5, True, True, None, Codes.BadNoData),
        (LATER + 1, True, True, None, Codes.BadNoData),
    ],
)
def test_a_value_at_a_time(time: int, stepped: bool, simple: bool, value: float | None, code: int) -> None:
    found = value_at(Samples(RAMP, 7, stepped), time, LATER, simple=simple)
    assert (found.Value.Value, found.StatusCode.value) == (value, code)
    assert found.SourceTimestamp == date_time(time)


def test_between_texts_nothing_is_worked_out_and_integers_stay_integers() -> None:
    texts = Samples([sample(10, "ready"), sample(20, "fault")], stepped=False)
    found = value_at(texts, 15, LATER, simple=True)
    assert (found.Value.Value, found.StatusCode.value) == ("ready", UNSURE)
    words = Samples([sample(10, 1), sample(20, 4)], stepped=False)
    assert value_at(words, 15, LATER, simple=True).Value == ua.Variant(2, ua.VariantType.Int64)


def test_a_good_value_is_not_looked_for_without_end() -> None:
    bad = [sample(time, None, Codes.BadNoCommunication) for time in range(1, 300)]
    far = value_at(Samples([sample(0, 1.0), *bad]), 1000, LATER, simple=False)
    near = value_at(Samples([sample(0, 1.0), *bad[:50]]), 1000, LATER, simple=False)
    assert far.StatusCode.value == Codes.BadNoData
    assert (near.Value.Value, near.StatusCode.value) == (1.0, UNSURE)
