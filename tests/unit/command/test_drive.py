"""What is shown of a drive beside its process data, at once when it changes; and the times that follow from
how its bus is set."""

from __future__ import annotations

import pytest

from bridge.command import Action, Identification
from bridge.drive import OwnJudgement, OwnVerdict
from bridge.drive.own_judgement import DriveWatch
from bridge.image import Quality, Reading
from tests.support import sites
from tests.support.node_states import hand_over
from tests.support.rig import ENABLED
from tests.unit.command.test_plant import SITE, Hall

UNREAD = "P105 cannot be read and is not in the site file"


def alone(drive: str = "", bus: str = "") -> Hall:
    """A single drive on its node, P151 = 200 ms on our side."""
    node = sites.node(sites.drive("fu1", "modbus", 200, f"parameters = {{ P105 = 50.0 }}\n{drive}"))
    return Hall(sites.site(sites.bus(node, more=bus), sites.modbus()))


@pytest.fixture
def hall() -> Hall:
    return Hall()


# what the boot-up has found


def test_what_a_node_does_not_tell_of_itself_is_0_or_empty(hall: Hall) -> None:
    hall.drive.on_identification(Identification(), 5.0)
    numbers = [hall.read(f"identity/{leaf}") for leaf in ("vendor", "product", "revision", "serial")]
    assert numbers == [Reading(0, Quality.GOOD, 5.0, "")] * 4
    assert hall.read("identity/device_name") == Reading("", Quality.GOOD, 5.0, "")


def test_a_word_that_a_node_does_not_take_is_a_configuration_error_until_it_does(hall: Hall) -> None:
    why = "not in its RPDOs"
    hall.drive.on_pdos({"command/setpoint_1": why}, (), 5.0, deadline_s=None, rpdo_type=255)
    for leaf in ("command/setpoint_1", "command/frequency"):
        assert hall.read(leaf) == Reading(0, Quality.CONFIG_ERROR, 5.0, why)
    assert hall.read("command/setpoint_2").quality is Quality.GOOD
    hall.drive.on_pdos({}, (), 6.0, deadline_s=None, rpdo_type=255)
    for leaf in ("command/setpoint_1", "command/frequency"):
        assert hall.read(leaf) == Reading(0, Quality.GOOD, 6.0, "")


def test_a_setpoint_whose_scale_nobody_knows_is_a_configuration_error(hall: Hall) -> None:
    """fu2 has no P105 in the site file."""
    infeed = hall.plant.drives["conveyor/infeed"]
    reading = hall.plant.image.read("conveyor/infeed/command/frequency")
    assert (reading.quality, reading.reason) == (Quality.CONFIG_ERROR, UNREAD)
    infeed.channel.meanings.on_scale("P105", 60.0)
    infeed.compile()
    infeed.refresh(6.0)
    assert hall.plant.image.read("conveyor/infeed/command/frequency").quality is Quality.GOOD


def test_how_late_the_process_data_may_be_is_what_the_boot_up_has_found(hall: Hall) -> None:
    hall.run()
    hall.drive.on_pdos({}, (), hall.now, deadline_s=0.25, rpdo_type=255)
    for seconds, quality in ((0.2, Quality.GOOD), (0.25, Quality.STALE)):
        hall.now = 100.0 + seconds
        hall.plant.refresh(hall.now)
        assert hall.read("actual/value_1").quality is quality
        assert hall.read("supervision/follows").quality is quality
        assert hall.read("supervision/last_stop").quality is Quality.GOOD, "that is the bridge's own"


def test_why_a_drive_refused_is_shown(hall: Hall) -> None:
    hall.drive.on_sdo_refused(0x06010002, 7.0)
    assert hall.read("supervision/sdo_abort_code") == Reading(0x06010002, Quality.GOOD, 7.0, "")


def test_a_fault_that_the_drive_was_asked_for_is_shown_at_once(hall: Hall) -> None:
    hall.drive.channel.on_drive_fault(3.0, 4.0, 7.0)
    assert hall.read("supervision/current_fault") == Reading(3.0, Quality.GOOD, 7.0, "")
    assert hall.read("supervision/last_fault") == Reading(4.0, Quality.GOOD, 7.0, "")


def test_a_refusal_elsewhere_is_shown_at_once(hall: Hall) -> None:
    hall.drive.channel.on_refused(7.0)
    assert hall.read("supervision/refused_writes") == Reading(1, Quality.GOOD, 7.0, "")


def test_ages_and_counts_are_those_of_the_moment_when_somebody_looks(hall: Hall) -> None:
    hall.run()
    hall.submit(Action.KEEP_ALIVE)
    hall.now += 0.0625
    hall.view.look("conveyor/fu1")
    leaves = ("telegrams", "pdo_age_ms", "watchdog_left_ms")
    assert [hall.read(f"supervision/{leaf}").value for leaf in leaves] == [3, 62, 138]
    assert {hall.read(f"supervision/{leaf}").time for leaf in leaves} == {hall.now}


# what it does by itself when the bridge falls silent


def judged(time_ms: float, verdict: OwnVerdict, why: str = "") -> OwnJudgement:
    return OwnJudgement(
        (DriveWatch("P151", "process_data", "P151", time_ms, "", verdict, why, silent_ms=100),)
    )


STOPS = judged(300.0, OwnVerdict.STOPS)
RUNS_ON = judged(0.0, OwnVerdict.RUNS_ON, "P151 is 0")
WAY_AND_OURS = 25 + 200 + 20 + 10 + 10
"""In ms: the telegram's way, the time-out, the bridge's lateness, and two RPDO periods."""


def shown(hall: Hall, leaf: str) -> tuple[object, Quality, str]:
    reading = hall.read(f"supervision/{leaf}")
    return reading.value, reading.quality, reading.reason


def test_the_time_to_a_stop_by_silence_has_the_drives_own() -> None:
    hall = alone('on_expiry = "silence"')
    unread = "the drive's own time-out has not been read yet"
    assert shown(hall, "worst_case_stop_ms") == (0, Quality.CONFIG_ERROR, unread)
    hall.drive.on_own_supervision(STOPS, 1.0)
    assert shown(hall, "worst_case_stop_ms") == (WAY_AND_OURS + 300, Quality.GOOD, "")
    hall.drive.on_own_supervision(judged(500.0, OwnVerdict.STOPS), 2.0)
    assert shown(hall, "worst_case_stop_ms") == (WAY_AND_OURS + 500, Quality.GOOD, "")
    hall.drive.on_own_supervision(RUNS_ON, 3.0)
    assert shown(hall, "worst_case_stop_ms") == (WAY_AND_OURS, Quality.GOOD, ""), "disable voltage instead"


@pytest.mark.parametrize(("own", "is_silent"), [(STOPS, True), (RUNS_ON, False)])
def test_silence_is_a_stop_only_for_a_drive_that_watches_its_process_data(
    own: OwnJudgement, is_silent: bool
) -> None:
    hall = alone('on_expiry = "silence"')
    hall.run()
    hall.drive.on_own_supervision(own, hall.now)
    hall.at(100.2001)
    words, silent = hall.drive.channel.output
    assert silent is is_silent
    assert not hall.drive.channel.words.enables(words[0])


def test_one_that_is_not_known_any_more_gets_disable_voltage_instead() -> None:
    hall = alone('on_expiry = "silence"')
    hall.drive.on_own_supervision(STOPS, 1.0)
    hall.drive.on_own_supervision_changed("P151 has been written", 2.0)
    assert shown(hall, "worst_case_stop_ms") == (WAY_AND_OURS, Quality.GOOD, "")
    assert shown(hall, "worst_case_bridge_ms") == (0, Quality.CONFIG_ERROR, "P151 has been written")


@pytest.mark.parametrize(
    ("own", "expected"),
    [
        (STOPS, (400, Quality.GOOD, "")),
        (RUNS_ON, (0, Quality.CONFIG_ERROR, "the drive runs on: P151 is 0")),
        (judged(0.0, OwnVerdict.UNKNOWN, "no P151"), (0, Quality.CONFIG_ERROR, "not known: no P151")),
        (OwnJudgement(RUNS_ON.watches, accepted="a fan"), (0, Quality.GOOD, "a fan")),
    ],
)
def test_how_long_a_hang_of_the_bridge_may_move_it(
    own: OwnJudgement, expected: tuple[object, Quality, str]
) -> None:
    hall = alone()
    hall.drive.on_own_supervision(own, 1.0)
    assert shown(hall, "worst_case_bridge_ms") == expected


# times that follow from the bus


@pytest.mark.parametrize(
    ("bus", "rpdo_type", "on_its_way_ms", "takeover_s"),
    [
        ("rpdo_period_ms = 40\nsync_period_ms = 25", 255, 40, 0.0),
        ("rpdo_period_ms = 40\nsync_period_ms = 25", 254, 40, 0.0),
        ("rpdo_period_ms = 40\nsync_period_ms = 25", 1, 65, 0.045),
        ("rpdo_period_ms = 40\nsync_period_ms = 25", 4, 140, 0.12),
        ("rpdo_period_ms = 1000\nsync_period_ms = 0\ndeadman_ms = 2000", 255, 1000, 0.0),
    ],
)
def test_how_long_a_word_may_be_on_its_way(
    bus: str, rpdo_type: int, on_its_way_ms: int, takeover_s: float
) -> None:
    """Until its frame, and until the SYNC that takes it over (CiA 301 v4.2.0, 7.5.2.35) and what the bridge
    may be late."""
    hall = alone(bus=bus)
    assert hall.drive.rpdo_period_ms == round(hall.drive.bus.rpdo_period_s * 1000)
    hall.drive.on_pdos({}, (), 1.0, deadline_s=None, rpdo_type=rpdo_type)
    assert hall.drive.rpdo_period_ms == on_its_way_ms
    assert hall.drive.takeover_s == pytest.approx(takeover_s, abs=1e-6)


@pytest.mark.parametrize(("left_s", "is_told"), [(0.12002, False), (0.11998, True)])
def test_a_sign_of_life_is_told_to_a_bus_that_goes_on_for_that_long(left_s: float, is_told: bool) -> None:
    """For ``deadman_ms`` and one RPDO period after the bridge's last word to it."""
    hall = alone(bus="deadman_ms = 100\nrpdo_period_ms = 20")
    hall.run()
    hall.now += 0.2 - left_s
    hall.flushed.clear()
    hall.submit(Action.KEEP_ALIVE)
    assert bool(hall.flushed) is is_told


# a stop


def test_when_a_stop_is_judged_is_a_deadline_of_the_plant() -> None:
    """Where nothing else is due: no time-out, and a drive that sends changes alone."""
    hall = Hall(SITE.replace("fieldbus_timeout_ms = 200", "fieldbus_timeout_ms = 0"))
    hall.run()
    hall.drive.channel.link.pdo_deadline_s = None
    for drive in hall.plant.drives.values():
        hand_over(hall.plant, drive, hall.now)
    hall.at(hall.now)
    assert hall.drive.next_deadline(hall.now) is None
    hall.submit(Action.STOP)
    hand_over(hall.plant, hall.drive, hall.now)
    due = hall.drive.next_deadline(hall.now)
    # Three times 0.5 s, one RPDO period, and NORD's 0.25 s and 60 s for a word that may begin a ramp.
    assert due == pytest.approx(100 + 1.5 + 0.01 + 0.25 + 60)
    assert hall.plant.next_deadline(hall.now) == due
    hall.at(due)
    assert hall.value("supervision/last_stop") == 3
    assert hall.value("supervision/follows") is False


def test_the_earlier_of_the_trip_and_the_judgement_is_the_next_deadline() -> None:
    hall = Hall()
    hall.run()
    hall.drive.channel.link.pdo_deadline_s = None
    hall.submit(Action.DISABLE_VOLTAGE)
    hand_over(hall.plant, hall.drive, hall.now)
    assert hall.drive.next_deadline(hall.now) == pytest.approx(100.2)
    hall.at(100.2001)
    after = hall.drive.next_deadline(hall.now)
    assert after is not None
    assert after > 100.2001


def test_a_drive_whose_node_the_bridge_stops_is_not_said_to_follow() -> None:
    hall = Hall()
    hall.run()
    hall.pdo(ENABLED)
    hall.drive.channel.start_anew(hall.now)
    hall.drive.on_cut_off(hall.now)
    hall.at(170.0)
    assert hall.value("supervision/last_stop") == 3
