"""The leg between bridge and drive: quality over time, telegram downtime (twin of P513)."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.command import EventKind
from bridge.command.drive_link import DriveLink, NodeState
from bridge.image import Quality
from bridge.text import render
from tests.support.rig import ENABLED, Rig

_PAST = 1e-6


def link(downtime_s: float = 0.5, hold_ms: int = 2000, deadline_s: float | None = 0.1) -> DriveLink:
    link = DriveLink(downtime_s, hold_ms)
    link.pdo_deadline_s = deadline_s
    return link


class TestQuality:
    def test_waits_for_the_first_data(self):
        fresh = link()
        assert fresh.quality(0.0) is Quality.WAITING
        fresh.on_node(NodeState.BOOTING, 1.0)
        fresh.on_node(NodeState.OPERATIONAL, 2.0)
        assert fresh.quality(2.05) is Quality.WAITING

    def test_is_good_from_the_first_tpdo_to_its_deadline(self):
        good = link()
        good.on_node(NodeState.OPERATIONAL, 1.0)
        good.on_pdo(1.02)
        assert good.quality(1.02) is Quality.GOOD
        assert good.quality(1.1199) is Quality.GOOD
        assert good.quality(1.12 + _PAST) is Quality.STALE
        good.on_pdo(1.3)
        assert good.quality(1.3) is Quality.GOOD

    def test_stays_good_where_the_drive_sends_only_changes(self):
        good = link(deadline_s=None)
        good.on_node(NodeState.OPERATIONAL, 1.0)
        good.on_pdo(1.0)
        assert good.quality(1e6) is Quality.GOOD
        assert good.next_deadline() is None

    def test_goes_from_stale_to_lost_to_dead_and_back(self):
        aging = link(downtime_s=0.5, hold_ms=2000)
        aging.on_node(NodeState.OPERATIONAL, 1.0)
        aging.on_pdo(1.0)
        assert aging.next_deadline() == 1.1
        assert not aging.on_time(1.1)
        assert aging.quality(1.1) is Quality.STALE
        assert aging.next_deadline() == 1.5
        assert aging.on_time(1.5)
        assert aging.quality(1.5) is Quality.LOST
        assert not aging.may_enable
        assert aging.next_deadline() == 3.5
        assert not aging.on_time(3.5)
        assert aging.quality(3.4999) is Quality.LOST
        assert aging.quality(3.5) is Quality.DEAD
        assert aging.next_deadline() is None
        assert aging.on_pdo(9.0)
        assert aging.quality(9.0) is Quality.GOOD
        assert aging.may_enable

    def test_a_deadline_that_passed_unseen_is_still_due(self):
        """The process is a little late each time: nothing that has become due is lost with it."""
        late = link(downtime_s=0.5)
        late.on_node(NodeState.OPERATIONAL, 1.0)
        late.on_pdo(1.0)
        late.on_time(1.05)
        assert late.next_deadline() == 1.1
        assert late.on_time(1.7)

    def test_is_lost_at_once_with_the_node_and_dead_after_hold(self):
        lost = link(hold_ms=300)
        lost.on_node(NodeState.OPERATIONAL, 1.0)
        lost.on_pdo(1.0)
        lost.on_node(NodeState.LOST, 1.05)
        assert lost.quality(1.05) is Quality.LOST
        assert lost.next_deadline() == pytest.approx(1.35)
        assert lost.quality(1.35 + _PAST) is Quality.DEAD
        lost.on_node(NodeState.BOOTING, 2.0)
        assert lost.quality(2.0) is Quality.DEAD
        lost.on_node(NodeState.OPERATIONAL, 2.1)
        assert lost.quality(2.1) is Quality.STALE
        lost.on_pdo(2.11)
        assert lost.quality(2.11) is Quality.GOOD

    def test_a_stray_tpdo_of_a_lost_node_is_not_good(self):
        lost = link()
        lost.on_node(NodeState.OPERATIONAL, 1.0)
        lost.on_node(NodeState.LOST, 1.5)
        assert not lost.on_pdo(1.6)
        assert lost.quality(1.6) is Quality.LOST

    def test_a_node_that_restarts_is_stale(self):
        restarting = link()
        restarting.on_node(NodeState.OPERATIONAL, 1.0)
        restarting.on_pdo(1.0)
        restarting.on_node(NodeState.BOOTING, 1.05)
        assert restarting.quality(1.06) is Quality.STALE

    def test_a_disabled_node_waits_for_data_when_it_is_enabled_again(self):
        link_ = link()
        link_.on_node(NodeState.OPERATIONAL, 1.0)
        link_.on_pdo(1.0)
        link_.on_node(NodeState.DISABLED, 2.0)
        assert link_.quality(2.0) is Quality.DISABLED
        assert link_.age_ms(2.0) == 0xFFFF_FFFF
        link_.on_node(NodeState.ABSENT, 3.0)
        assert link_.quality(3.0) is Quality.WAITING

    def test_a_mapping_that_does_not_apply_is_a_configuration_error(self):
        link_ = link()
        link_.on_pdo(1.0)
        link_.on_node(NodeState.CONFIG_ERROR, 1.0)
        assert link_.quality(1.0) is Quality.CONFIG_ERROR
        assert not link_.may_enable

    def test_a_reason_goes_with_what_is_not_good(self):
        link_ = link()
        link_.on_node(NodeState.OPERATIONAL, 1.0)
        assert link_.reason(Quality.GOOD) == ""
        assert render(link_.reason(Quality.STALE)) == "no process data from the drive"
        link_.on_node(NodeState.LOST, 2.0)
        assert render(link_.reason(Quality.LOST)) == "node lost"


class TestTelegramDowntime:
    def test_expires_after_its_time_is_reported_once_and_stops_the_drive(self):
        rig = Rig(pdo_deadline_s=0.1, telegram_downtime_s=0.3, fieldbus_timeout_ms=0)
        rig.run()
        rig.wait(0.299)
        assert rig.enables
        rig.wait(0.001)
        assert not rig.enables
        assert rig.channel.current_fault == 10.2
        assert rig.channel.fault_text == "E010/10.2 telegram downtime of the external bus interface"
        rig.wait(10)
        assert len(rig.told(EventKind.WATCHDOG)) == 1
        assert rig.channel.trips == 0

    def test_ends_with_the_next_tpdo_and_leaves_the_drive_stopped(self):
        rig = Rig(pdo_deadline_s=0.1, telegram_downtime_s=0.3, fieldbus_timeout_ms=0)
        rig.run()
        rig.wait(1)
        rig.drive_says(ENABLED)
        assert rig.channel.current_fault == 0
        assert rig.channel.last_fault == 10.2
        assert not rig.enables

    def test_zero_is_no_supervision(self):
        rig = Rig(pdo_deadline_s=0.1, telegram_downtime_s=0, fieldbus_timeout_ms=0)
        rig.run()
        rig.wait(100)
        assert rig.enables

    def test_is_never_shorter_than_the_drives_own_pause(self):
        slow = link(downtime_s=0.1, deadline_s=1.0)
        slow.on_node(NodeState.OPERATIONAL, 1.0)
        slow.on_pdo(1.0)
        assert not slow.on_time(1.9)
        assert slow.on_time(2.0)

    def test_runs_from_the_start_of_operation_too(self):
        """A node that says it is operational and never sends a PDO."""
        mute = link(downtime_s=0.5)
        mute.on_node(NodeState.OPERATIONAL, 1.0)
        assert not mute.on_time(1.4999)
        assert mute.on_time(1.5)

    def test_does_not_run_while_the_node_boots(self):
        booting = link(downtime_s=0.1)
        booting.on_node(NodeState.BOOTING, 1.0)
        assert not booting.on_time(100.0)

    def test_age(self):
        link_ = link()
        assert link_.age_ms(5.0) == 0xFFFF_FFFF
        link_.on_pdo(5.0)
        assert link_.age_ms(5.25) == 250
        assert link_.age_ms(4.9) == 0
        assert link_.age_ms(1e9) == 0xFFFF_FFFE


_STEP = st.one_of(
    st.sampled_from(list(NodeState)),
    st.just("pdo"),
    st.floats(0, 3, allow_nan=False),
)


@given(
    downtime_s=st.sampled_from([-0.1, 0, 0.1, 0.5, 100.0]),
    hold_ms=st.sampled_from([0, 50, 2000]),
    deadline_s=st.sampled_from([None, 0.03, 0.6]),
    steps=st.lists(_STEP, max_size=30),
)
def test_a_deadline_that_was_judged_is_not_asked_for_again(
    downtime_s: float, hold_ms: int, deadline_s: float | None, steps: list[NodeState | float | str]
):
    link_ = link(downtime_s, hold_ms, deadline_s)
    now = 1.0
    for step in steps:
        if isinstance(step, NodeState):
            link_.on_node(step, now)
        elif isinstance(step, str):
            link_.on_pdo(now)
        else:
            now += step
            before = link_.quality(now)
            link_.on_time(now)
            after = link_.quality(now)
            deadline = link_.next_deadline()
            assert deadline is None or deadline > now
            # Between two deadlines nothing changes by itself.
            just_before = (now + 1e6 if deadline is None else deadline) - _PAST
            if just_before > now:
                assert link_.quality(just_before) is after
            assert before is after or after is Quality.LOST or after is Quality.DEAD
