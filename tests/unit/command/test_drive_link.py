"""When a drive's data are fresh, to the very deadline, and how old they are said to be."""

from __future__ import annotations

import pytest

from bridge.command.drive_link import DriveLink, FurtherTpdo, NodeState
from bridge.image import Quality

DEADLINE_S = 0.125


def operational() -> DriveLink:
    link = DriveLink(0.5, 2000)
    link.on_boot(DEADLINE_S, ())
    link.on_node(NodeState.OPERATIONAL, 1.0)
    return link


@pytest.mark.parametrize(
    ("pdo_at", "now", "deadline_s", "is_fresh"),
    [
        (None, 1.0, DEADLINE_S, False),
        (1.0, 1.0, DEADLINE_S, True),
        (1.0, 1.0625, DEADLINE_S, True),
        (1.0, 1.125, DEADLINE_S, False),
        (1.0, 1000.0, None, True),
        (0.9375, 1.0, DEADLINE_S, False),  # of before its node became operational
    ],
)
def test_a_drive_is_fresh_from_its_first_tpdo_in_operation_to_the_deadline(
    pdo_at: float | None, now: float, deadline_s: float | None, is_fresh: bool
) -> None:
    link = DriveLink(0.5, 2000)
    link.on_boot(deadline_s, ())
    if pdo_at is not None and pdo_at < 1.0:
        link.on_pdo(pdo_at)
    link.on_node(NodeState.OPERATIONAL, 1.0)
    if pdo_at is not None and pdo_at >= 1.0:
        link.on_pdo(pdo_at)
    assert link.is_fresh(now) is is_fresh
    assert link.is_heard is (pdo_at is not None and pdo_at >= 1.0)
    assert (link.quality(now) is Quality.GOOD) is is_fresh


def test_a_tpdo_ends_an_expiry_once_and_only_where_the_node_is_there() -> None:
    link = operational()
    assert link.on_pdo(1.0) is False, "nothing had expired"
    assert link.on_time(1.5) is True
    assert link.is_expired
    assert link.on_pdo(1.625) is True
    assert link.on_pdo(1.75) is False
    link.on_node(NodeState.LOST, 2.0)
    assert link.on_pdo(2.0625) is False
    assert link.is_expired


# further TPDOs


def test_a_further_tpdo_is_late_from_its_deadline_on_and_says_so_once() -> None:
    pdo = FurtherTpdo("TPDO2", frozenset((1,)), DEADLINE_S)
    assert not pdo.is_fresh(0.0)
    assert [pdo.on_time(now) for now in (0.0, 100.0)] == [False, False], "it has not come yet"
    assert pdo.on_data(8.0) is True
    assert pdo.on_data(9.0) is False
    assert [pdo.is_fresh(now) for now in (9.0, 9.0625, 9.125)] == [True, True, False]
    assert [pdo.on_time(now) for now in (9.0625, 9.125, 9.25)] == [False, True, False]
    assert not pdo.is_fresh(9.0), "stale is stale until the next one"
    assert pdo.on_data(10.0) is True


def test_a_further_tpdo_that_is_sent_on_change_is_never_late() -> None:
    pdo = FurtherTpdo("TPDO2", frozenset((1,)), None)
    pdo.on_data(8.0)
    assert pdo.is_fresh(1e9) and not pdo.on_time(1e9)


# age


@pytest.mark.parametrize(
    ("pdo_at", "now", "age_ms"),
    [
        (None, 10.0, 0xFFFF_FFFF),
        (8.0, 8.0, 0),
        (8.0, 8.25, 250),
        (8.0, 18.0, 10_000),
        (8.0, 7.0, 0),  # read before, and asked for with an older time
        (8.0, 4_294_975.0, 4_294_967_000),
        (8.0, 5_000_000.0, 0xFFFF_FFFE),  # 50 days: as long as there was one at all
    ],
)
def test_the_age_is_in_milliseconds_and_has_a_number_for_never(
    pdo_at: float | None, now: float, age_ms: int
) -> None:
    link = operational()
    if pdo_at is not None:
        link.on_pdo(pdo_at)
    assert link.age_ms(now) == age_ms


@pytest.mark.parametrize(
    ("deadline_s", "pdo_at", "judged_at", "now", "is_earlier"),
    [
        (None, None, 1000.0, 1000.0, False),
        (DEADLINE_S, None, 1.0625, 2.0, False),
        (DEADLINE_S, None, 1.125, 2.0, True),
        (DEADLINE_S, 0.5, 1.0625, 2.0, False),
        (DEADLINE_S, 1.5, 1.5625, 1.5, False),
        (DEADLINE_S, 1.5, 1.625, 2.0, True),
        (DEADLINE_S, 1.5, 1.5625, 1.4375, True),
    ],
)
def test_a_tpdo_after_a_late_one_or_out_of_order_may_bring_an_earlier_deadline(
    deadline_s: float | None, pdo_at: float | None, judged_at: float, now: float, is_earlier: bool
) -> None:
    link = DriveLink(0.5, 2000)
    link.on_boot(deadline_s, ())
    link.on_node(NodeState.OPERATIONAL, 1.0)
    if pdo_at is not None:
        link.on_pdo(pdo_at)
    link.on_time(judged_at)
    assert link.brings_forward(now) is is_earlier
