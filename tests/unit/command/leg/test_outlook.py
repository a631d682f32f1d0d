"""The outlook of a leg: its watchdog, until when it enables, and what is sent then."""

from __future__ import annotations

from typing import get_args

import pytest

from bridge.catalogue.codes import WatchdogState
from bridge.command import TakeControl
from bridge.command.leg.outlook import next_deadline, output_then, trips_at, until, watchdog_state
from bridge.config import Reaction
from tests.support.leg import RUN, SHUT_DOWN, Leg, running_nord, settings_of
from tests.support.rig import OPERATOR


def test_the_watchdog_begins_with_the_first_telegram_and_says_when_it_has_tripped() -> None:
    """BU 2500 §7.1.1."""
    leg = Leg(settings_of("nord/sk-tu4-cao", fieldbus_timeout_ms=200))
    assert watchdog_state(leg.settings, leg.state) is WatchdogState.IDLE
    leg.writes(SHUT_DOWN)
    assert watchdog_state(leg.settings, leg.state) is WatchdogState.RUNNING
    leg.trips()
    assert watchdog_state(leg.settings, leg.state) is WatchdogState.TRIPPED


@pytest.mark.parametrize("given", [{"fieldbus_timeout_ms": 0}, {"telegram_downtime_s": -0.1}])
def test_without_a_time_or_where_errors_are_ignored_there_is_none(given: dict[str, object]) -> None:
    leg = running_nord(**given)
    assert watchdog_state(leg.settings, leg.state) is WatchdogState.OFF
    assert trips_at(leg.settings, leg.state) is None
    assert until(leg.settings, leg.state) is None


def test_a_drive_is_stopped_when_its_owners_time_is_up() -> None:
    leg = running_nord()
    assert trips_at(leg.settings, leg.state) == until(leg.settings, leg.state) == 100.2
    assert next_deadline(leg.state) == 100.2
    leg.trips()
    assert trips_at(leg.settings, leg.state) is None


def test_nothing_ends_where_nothing_enables() -> None:
    leg = Leg(settings_of("nord/sk-tu4-cao", fieldbus_timeout_ms=200))
    leg.writes(SHUT_DOWN)
    assert trips_at(leg.settings, leg.state) == 100.2
    assert until(leg.settings, leg.state) is None
    assert output_then(leg.settings, leg.state) == leg.state.sent


def test_a_drive_that_holds_goes_on_although_the_watchdog_trips() -> None:
    leg = running_nord(on_expiry="hold")
    assert trips_at(leg.settings, leg.state) == 100.2
    assert until(leg.settings, leg.state) is None


@pytest.mark.parametrize(("ttl_ms", "end"), [(100, 100.1), (1000, 100.2)])
def test_the_first_of_lease_and_watchdog_ends_it(ttl_ms: int, end: float) -> None:
    leg = Leg(settings_of("nord/sk-tu4-cao", control="lease", fieldbus_timeout_ms=200))
    leg.asks(TakeControl(ttl_ms), OPERATOR)
    leg.state = leg.state._replace(
        sent=leg.state.sent._replace(words=(RUN, *leg.setpoints)),
        timer=leg.state.timer._replace(deadline=100.2),
    )
    assert until(leg.settings, leg.state) == end


@pytest.mark.parametrize("reaction", sorted(set(get_args(Reaction)) - {"hold"}))
def test_what_is_sent_then_is_what_the_leg_itself_sends_then(reaction: str) -> None:
    leg = running_nord(on_expiry=reaction)
    then = output_then(leg.settings, leg.state)
    assert leg.enables, "looking ahead changes nothing"
    leg.trips()
    assert then == leg.state.sent
    assert then.silent or not leg.settings.words.enables(then.words[0])
