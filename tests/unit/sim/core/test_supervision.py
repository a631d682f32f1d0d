"""Watches and cycles of simulated nodes."""

from __future__ import annotations

from bridge.sim.core.supervision import FAILED, NO_RESPONSE, Cycle, HeartbeatWatch, SignWatch


def test_a_watch_begins_with_the_first_sign_and_trips_once() -> None:
    watch = SignWatch(lambda: 0.5)
    assert watch.next_deadline() is None
    assert not watch.expired(100.0)
    watch.start(1.0)
    assert watch.next_deadline() == 1.5
    assert not watch.expired(1.49)
    assert [watch.expired(1.5), watch.tripped, watch.expired(2.0)] == [True, True, False]
    watch.start(3.0)
    assert not watch.tripped


def test_with_0_nothing_is_watched() -> None:
    watch = SignWatch(lambda: 0.0)
    watch.start(1.0)
    assert (watch.next_deadline(), watch.expired(1e9)) == (None, False)


def test_a_consumer_tells_a_producer_that_was_never_there_from_one_that_failed() -> None:
    consumer = HeartbeatWatch(lambda: 127, lambda: 200)
    assert (consumer.node, consumer.status) == (127, NO_RESPONSE)
    assert not consumer.on_heartbeat(b"\x85", 1.0)
    assert consumer.status == 5
    assert consumer.expired(1.2)
    assert consumer.status == FAILED
    assert consumer.on_heartbeat(b"\x05", 2.0), "it is back"
    assert not consumer.on_heartbeat(b"\x05\x00", 2.1)
    consumer.stop()
    assert consumer.status == NO_RESPONSE


def test_a_cycle_skips_what_it_has_missed_and_begins_anew_with_a_new_period() -> None:
    periods = [0.1]
    cycle = Cycle(lambda: periods[-1])
    assert not cycle.due(0.0)
    assert cycle.next_deadline() == 0.1
    assert [cycle.due(0.1), cycle.due(0.15), cycle.due(5.0), cycle.due(5.05)] == [True, False, True, False]
    periods.append(1.0)
    assert not cycle.due(5.1)
    assert cycle.next_deadline() == 6.1
    periods.append(0.0)
    assert not cycle.due(6.1)
    assert cycle.next_deadline() is None
