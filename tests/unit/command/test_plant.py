"""The plant: what users see of drives and nodes, and how requests reach them."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.command import (
    Action,
    Code,
    Do,
    Drive,
    Event,
    EventKind,
    Identification,
    Outcome,
    PlantView,
    Reply,
    Request,
    Start,
    Write,
    command_of,
)
from bridge.command.drive_link import REASONS, NodeState
from bridge.command.worst_case import Wire
from bridge.image import Quality, Reading, Value
from tests.support import sites
from tests.support.devices import ENCODER
from tests.support.node_states import node_goes, run_timers
from tests.support.nodes import device_plant
from tests.support.rig import (
    ACKNOWLEDGE,
    ENABLE,
    ENABLED,
    FAULT,
    HALF_SPEED,
    INHIBITED,
    OPERATOR,
    OTHER_PLC,
    PLC,
    READY,
    SHUT_DOWN,
    emergency,
)

SITE = sites.site(
    sites.bus(
        sites.node(
            sites.drive("fu1", "modbus", 200, "parameters = { P105 = 50.0 }"),
            sites.drive("fu2", "lease", 0, 'name = "infeed"\nunit_id = 1'),
        )
    ),
    sites.modbus(),
)


class Hall:
    """A plant on a virtual clock, and what it told."""

    def __init__(self, text: str = SITE) -> None:
        self.plant = sites.plant_of(text)
        self.node = self.plant.nodes["conveyor"]
        self.events: list[Event] = []
        self.plant.on_event(self.events.append)
        self.flushed: list[tuple[int, ...]] = []
        self.now = 100.0
        self.view = PlantView(
            self.plant,
            lambda: self.now,
            lambda at: round(at * 1e9),
            lambda request, now, reply: self.carry_out(request, reply),
            lambda: self.flushed.append(self.drive.channel.output.words),
        )

    def carry_out(self, request: Request, reply: Reply) -> bool:
        """There is a bus, where ``on_bus`` says so, with one node."""
        if self.on_bus and request.target == "conveyor":
            reply(Outcome(Code.OK, request.target))
            return True
        return False

    on_bus = False

    @property
    def drive(self) -> Drive:
        return self.plant.drives["conveyor/fu1"]

    def submit(self, action: Action, target: str = "conveyor/fu1", identity=PLC, **more) -> Outcome:
        outcomes: list[Outcome] = []
        self.view.submit(Request(identity, target, command_of(action, **more)), outcomes.append)
        (outcome,) = outcomes
        return outcome

    def write(self, identity=PLC, **values: Value) -> Outcome:
        return self.submit(Action.WRITE, identity=identity, values=values)

    def at(self, now: float) -> None:
        """The master's round at this time."""
        self.now = now
        run_timers(self.plant, now)

    def pdo(self, *words: int) -> None:
        self.drive.on_process_data((*words, 0, 0, 0)[:4], self.now)

    def read(self, leaf: str) -> Reading:
        return self.plant.image.read(f"conveyor/fu1/{leaf}")

    def value(self, leaf: str) -> Value:
        return self.read(leaf).value

    def run(self) -> None:
        self.drive.channel.link.pdo_deadline_s = 0.1
        node_goes(self.plant, self.node, NodeState.OPERATIONAL, self.now)
        self.pdo(READY)
        self.write(control_word=SHUT_DOWN)
        self.write(control_word=ENABLE, setpoint_1=HALF_SPEED)
        self.pdo(ENABLED, 0x2000, 0x4000)


@pytest.fixture
def hall() -> Hall:
    return Hall()


@pytest.fixture
def running(hall: Hall) -> Hall:
    hall.run()
    return hall


class TestPoints:
    CONTRACT = (
        "command/control_word command/setpoint_1 command/setpoint_2 command/setpoint_3 command/frequency "
        "status/status_word status/drive_status_word status/state status/fault_text "
        "actual/value_1 actual/value_2 actual/value_3 actual/frequency actual/current "
        "supervision/owner supervision/watchdog_state supervision/watchdog_left_ms "
        "supervision/fieldbus_timeout_ms supervision/telegram_downtime_s supervision/last_fault "
        "supervision/current_fault supervision/trips supervision/worst_case_stop_ms supervision/pdo_age_ms "
        "identity/vendor identity/product identity/revision identity/serial identity/device_name"
    )

    @pytest.mark.landing(29)
    @pytest.mark.parametrize("leaf", CONTRACT.split())
    def test_every_drive_has_the_names_of_the_contract(self, hall: Hall, leaf: str):
        for drive in ("fu1", "infeed"):
            assert f"conveyor/{drive}/{leaf}" in hall.plant.image.index

    @pytest.mark.parametrize(
        "name",
        [
            "conveyor/node/nmt_state",
            "conveyor/node/supervision_state",
            "conveyor/node/boot_status",
            "bus/can0/state",
            "bus/can0/load",
            "bus/can0/tx_errors",
            "bus/can0/rx_errors",
            "bus/can0/frames_lost",
        ],
    )
    def test_nodes_and_buses_too(self, hall: Hall, name: str):
        assert name in hall.plant.image.index

    def test_commands_are_writable_and_parameters_but_for_those_the_drive_only_shows(self, hall: Hall):
        faults = ("/parameter/p700_", "/parameter/p701_")  # P700, P701: information parameters
        for point in hall.plant.image.points:
            parameter = "/parameter/" in point.name and not any(leaf in point.name for leaf in faults)
            assert point.writable is (parameter or "/command/" in point.name), point.name

    def test_a_known_scale_gives_a_range(self, hall: Hall):
        points = {point.name: point for point in hall.plant.image.points}
        known = points["conveyor/fu1/command/frequency"]
        assert (known.low, known.unit) == (-100.0, "Hz")
        assert points["conveyor/infeed/command/frequency"].low is None

    def test_the_bridge_says_what_it_is(self, hall: Hall):
        assert hall.plant.image.read("bridge/version").value == "1.2.3"
        assert hall.plant.image.read("bridge/drives_configured").value == 2

    def test_the_worst_case_is_the_time_out_two_cycles_and_the_bridges_own(self, hall: Hall):
        assert hall.value("supervision/worst_case_stop_ms") == 25 + 200 + 20 + 10 + 10
        assert hall.plant.image.read("conveyor/infeed/supervision/worst_case_stop_ms").value == 0

    def test_what_is_predicted_of_its_bus_is_in_the_worst_case_at_once(self, hall: Hall):
        before = hall.value("supervision/worst_case_stop_ms")
        hall.plant.drives["conveyor/fu1"].on_wire(Wire(frames_ms=0.5, before_ms=5.1), 1.0)
        assert hall.value("supervision/worst_case_stop_ms") == before + 6
        hall.plant.drives["conveyor/fu1"].on_wire(Wire(frames_ms=0.5, before_ms=None), 2.0)
        reading = hall.plant.image.read("conveyor/fu1/supervision/worst_case_stop_ms")
        assert reading.quality is Quality.CONFIG_ERROR
        assert "more than 100 %" in reading.reason


class TestData:
    def test_wait_for_the_first_tpdo(self, hall: Hall):
        for leaf in ("status/status_word", "actual/value_1", "actual/frequency"):
            assert hall.read(leaf).quality is Quality.WAITING
        assert hall.read("supervision/watchdog_state").quality is Quality.GOOD

    def test_are_there_with_their_time_raw_and_scaled(self, running: Hall):
        assert running.read("status/status_word") == Reading(ENABLED, Quality.GOOD, 100.0, "")
        assert running.value("status/state") == 4
        assert running.value("actual/value_1") == 0x2000
        assert running.read("actual/frequency") == Reading(25.0, Quality.GOOD, 100.0, "")

    def test_a_value_that_did_not_change_keeps_its_time(self, running: Hall):
        running.now = 100.05
        running.pdo(ENABLED, 0x2001, 0x4000)
        assert running.read("actual/value_1").time == 100.05
        assert running.read("actual/value_2").time == 100.0

    def test_negative_values_are_twos_complement(self, running: Hall):
        running.pdo(ENABLED, 0xC000)
        assert running.value("actual/frequency") == -50.0
        assert running.value("actual/value_1") == 0xC000

    def test_an_unknown_scale_is_a_configuration_error_and_says_which(self, running: Hall):
        reading = running.read("actual/current")
        assert reading == Reading(16384.0, Quality.CONFIG_ERROR, 100.0, reading.why)
        assert reading.reason == "P112 cannot be read and is not in the site file"

    def test_a_scale_learned_at_boot_up_counts_from_then_on(self, running: Hall):
        running.drive.channel.meanings.on_scale("P112", 8.0)
        running.drive.compile()
        running.pdo(ENABLED, 0x2000, 0x4000)
        assert running.read("actual/current").quality is Quality.GOOD
        assert running.value("actual/current") == 8.0
        running.drive.channel.meanings.on_scale("P105", 60.0)
        running.drive.compile()
        running.write(frequency=60.0)
        assert running.value("command/setpoint_1") == 0x4000
        assert running.value("command/frequency") == 60.0

    def test_a_scale_of_nothing_is_no_scale(self, running: Hall):
        running.drive.channel.meanings.on_scale("P112", 0.0)
        running.drive.compile()
        running.pdo(ENABLED, 0x2000, 0x4000)
        assert running.read("actual/current").quality is Quality.CONFIG_ERROR

    def test_grow_old_without_anybody_asking(self, running: Hall):
        running.at(100.1)
        assert running.read("actual/frequency").quality is Quality.STALE
        assert running.read("actual/frequency").reason == "no process data from the drive"
        running.at(100.5001)  # a little late: the deadline was 100.5
        assert running.read("actual/frequency").quality is Quality.LOST
        assert running.value("actual/frequency") == 25.0
        assert running.value("supervision/last_fault") == 10.2
        running.at(102.6)
        assert running.read("actual/frequency").quality is Quality.DEAD
        assert running.read("actual/current").quality is Quality.DEAD
        running.now = 103.0
        running.pdo(READY, 0, 0x4000)
        assert running.read("actual/frequency") == Reading(0.0, Quality.GOOD, 103.0, "")
        assert running.read("actual/current").quality is Quality.CONFIG_ERROR

    def test_an_unchanged_tpdo_makes_them_good_again(self, running: Hall):
        running.at(100.1)
        running.drive.on_unchanged_data(100.2)
        assert running.read("actual/frequency").quality is Quality.GOOD

    def test_a_lost_node_is_lost_at_once_and_told(self, running: Hall):
        node_goes(running.plant, running.node, NodeState.LOST, 100.05)
        assert running.read("status/state") == Reading(4, Quality.LOST, 100.05, REASONS[NodeState.LOST])
        assert [event.kind for event in running.events if event.source == "conveyor"] == [
            EventKind.NODE_BACK,
            EventKind.NODE_LOST,
        ]

    def test_a_disabled_node_is_disabled(self, running: Hall):
        node_goes(running.plant, running.node, NodeState.DISABLED, 100.05)
        assert running.read("actual/value_1").quality is Quality.DISABLED

    def test_the_identity_is_shown(self, hall: Hall):
        hall.drive.on_identification(Identification(0x38, 2, 3, 4, "SK TU4"), 5.0)
        assert hall.value("identity/vendor") == 0x38
        assert hall.read("identity/device_name") == Reading("SK TU4", Quality.GOOD, 5.0, "")

    def test_the_slow_part_counts_good_drives_and_ages(self, running: Hall):
        running.plant.refresh(100.04)
        assert running.plant.image.read("bridge/drives_good").value == 1
        assert running.value("supervision/pdo_age_ms") == 40
        assert running.value("supervision/watchdog_left_ms") == 160


class TestTrip:
    def test_is_seen_at_once_in_every_point_it_concerns(self, running: Hall):
        running.at(100.2001)
        assert running.value("supervision/watchdog_state") == 3
        assert running.value("supervision/current_fault") == 10.3
        assert running.value("supervision/trips") == 1
        assert running.value("supervision/sent_control_word") == 0x0474
        assert str(running.value("status/fault_text")).startswith("E010/10.3")
        assert running.value("status/state") == 7
        assert running.value("status/status_word") == 0x0B38
        assert running.value("status/drive_status_word") == ENABLED
        assert running.plant.image.read("conveyor/node/current_fault").value == 102.0

    def test_the_interfaces_fault_clears_itself_and_is_remembered_as_p170_does(self, running: Hall):
        last = "conveyor/node/last_fault"
        assert running.plant.image.read(last).value == 0.0
        running.at(100.21)
        running.now = 100.22
        running.pdo(READY, 0)
        running.pdo(ENABLED, 0x1000)
        assert running.plant.image.read("conveyor/node/current_fault").value == 102.0
        assert running.plant.image.read(last).value == 0.0, "a present fault is not the last one"
        running.write(control_word=SHUT_DOWN)
        assert running.plant.image.read("conveyor/node/current_fault").value == 0.0
        assert running.plant.image.read(last).value == 102.0
        assert running.value("supervision/current_fault") == 10.3
        running.write(control_word=ACKNOWLEDGE)
        assert running.value("supervision/current_fault") == 0.0
        assert running.value("supervision/last_fault") == 10.3
        assert running.value("supervision/watchdog_state") == 2
        assert running.value("status/status_word") == ENABLED

    def test_a_gap_of_the_bridge_changes_what_its_bus_is_sent(self, running: Hall):
        running.plant.take_changed("can0")
        running.drive.channel.on_bridge_gap(100.0)
        assert running.plant.take_changed("can0") == {"conveyor"}
        assert running.plant.take_changed("can0") == set()

    def test_is_known_at_once_where_a_deadline_is_brought_forward(self, running: Hall):
        running.drive.channel.link.pdo_deadline_s = None
        assert running.plant.next_deadline(100.0) == pytest.approx(100.2)
        running.drive.channel.link.pdo_deadline_s = 0.1
        running.drive.channel.plan_anew()
        assert running.plant.next_deadline(100.0) == pytest.approx(100.1)

    def test_comes_at_the_time_the_plant_asked_for(self, running: Hall):
        running.drive.channel.link.pdo_deadline_s = None
        assert running.plant.next_deadline(100.0) == pytest.approx(100.2)
        running.at(100.1)
        assert running.value("supervision/watchdog_state") == 2

    def test_then_silence_is_not_missed_by_a_late_round(self):
        hall = Hall(
            SITE.replace("fieldbus_timeout_ms = 200", "fieldbus_timeout_ms = 200\nthen_silence_ms = 50")
        )
        hall.run()
        hall.drive.channel.link.pdo_deadline_s = None
        hall.at(100.2007)
        assert not hall.drive.channel.output.silent
        hall.at(100.2513)
        assert hall.drive.channel.output.silent

    def test_another_drive_of_the_node_is_untouched(self, running: Hall):
        running.at(100.3)
        infeed = running.plant.drives["conveyor/infeed"].channel
        assert infeed.watchdog_state.label == "off"
        assert infeed.current_fault == 0


class TestRequests:
    def test_go_to_the_bus_at_once(self, running: Hall):
        running.flushed.clear()
        running.write(setpoint_1=0x1000)
        assert running.flushed == [(ENABLE, 0x1000, 0, 0, 0)]
        running.write(setpoint_1=0x1000)
        assert len(running.flushed) == 1

    def test_are_shown_at_once(self, running: Hall):
        running.write(control_word=0x0C7F, frequency=12.5)
        assert running.value("command/control_word") == 0x0C7F
        assert running.value("command/setpoint_1") == 0x1000
        assert running.value("command/frequency") == 12.5
        assert running.value("supervision/owner") == "modbus:192.168.1.10"

    def test_who_reads_on_the_outcome_reads_what_it_is_about(self, running: Hall):
        seen: list[Value] = []

        def on_outcome(outcome: Outcome) -> None:
            seen.append(running.value("command/frequency"))

        request = Request(PLC, "conveyor/fu1", Write({"frequency": 5.0}))
        running.view.submit(request, on_outcome)
        assert seen == [pytest.approx(5.0, abs=0.01)]

    def test_a_stop_reaches_the_bus_even_if_its_answer_cannot_be_told(self, running: Hall):
        running.flushed.clear()

        def on_outcome(outcome: Outcome) -> None:
            raise ConnectionResetError

        request = Request(OPERATOR, "conveyor/fu1", Do(Action.STOP))
        with pytest.raises(ConnectionResetError):
            running.view.submit(request, on_outcome)
        assert running.flushed == [(SHUT_DOWN, 0, 0, 0, 0)]

    def test_of_a_telegram_of_several_requests_the_bus_gets_what_the_last_one_leaves(self, running: Hall):
        """An enable that is written together with a release is none."""
        running.flushed.clear()

        def on_written(outcome: Outcome) -> None:
            running.view.submit(Request(PLC, "conveyor/fu1", Do(Action.RELEASE_CONTROL)), outcomes.append)

        outcomes: list[Outcome] = []
        write = Request(PLC, "conveyor/fu1", Write({"control_word": ENABLE, "setpoint_1": 0x1000}))
        running.view.submit(write, on_written)
        assert [outcome.ok for outcome in outcomes] == [True]
        assert {words[:2] for words in running.flushed} == {(SHUT_DOWN, 0)}

    def test_refused_ones_are_counted(self, running: Hall):
        assert running.write(OTHER_PLC, control_word=SHUT_DOWN).code is Code.NOT_ALLOWED
        assert running.value("supervision/refused_writes") == 1
        running.plant.refresh(running.now)
        assert running.plant.image.read("bridge/refused_writes").value == 1

    @pytest.mark.parametrize("target", ["conveyor/fu9", "conveyor", "", "conveyor/fu1/command"])
    def test_to_what_is_not_there_have_an_outcome_too(self, hall: Hall, target: str):
        assert hall.submit(Action.STOP, target).code is Code.UNKNOWN_TARGET

    def test_on_a_node_go_to_who_looks_after_it(self, hall: Hall):
        assert hall.submit(Action.RESET, "conveyor").code is Code.UNKNOWN_TARGET
        hall.on_bus = True
        assert hall.submit(Action.RESET, "conveyor").message == "conveyor"
        assert hall.submit(Action.RESET, "lift").code is Code.UNKNOWN_TARGET

    def test_a_start_is_shown_when_it_is_done(self, hall: Hall):
        node_goes(hall.plant, hall.node, NodeState.OPERATIONAL, hall.now)
        hall.pdo(INHIBITED)
        seen: list[Value] = []
        request = Request(PLC, "conveyor/fu1", Start())
        hall.view.submit(request, lambda outcome: seen.append(hall.value("status/state")))
        hall.pdo(READY)
        hall.pdo(ENABLED)
        assert not seen, "nothing is told in the midst of a round"
        hall.plant.deliver_outcomes()
        assert seen == [4]


def test_a_fault_of_the_drive_is_told_in_the_manuals_words(running: Hall):
    running.drive.channel.on_emcy(emergency(0x2310), running.now)
    running.pdo(FAULT)
    assert running.value("status/emcy_code") == 0x2310
    assert running.value("status/fault_text") == "3.0 overcurrent of the inverter"
    running.plant.tell_events()
    assert [event.message for event in running.events if event.kind is EventKind.EMERGENCY] == [
        "emergency 2310h: 3.0 overcurrent of the inverter"
    ]
    running.drive.channel.on_emcy(emergency(0), running.now)
    running.pdo(READY)
    assert running.value("status/fault_text") == ""


def test_a_feed_sees_what_a_tpdo_changed_and_nothing_else(running: Hall):
    feed = running.plant.image.feed()
    feed.take(10_000)
    running.now = 100.01
    running.pdo(ENABLED, 0x2100, 0x4000)
    changed = [running.plant.image.points[index].name for index in feed.take(10_000)]
    assert changed == ["conveyor/fu1/actual/value_1", "conveyor/fu1/actual/frequency"]


def test_who_looks_sees_what_no_timer_has_told_yet(running: Hall):
    feed = running.plant.image.feed()
    feed.take(10_000)
    running.now += 0.15
    assert running.read("status/status_word").quality is Quality.GOOD, "as of the last round"
    running.view.look("conveyor/fu1")
    assert running.read("status/status_word").quality is Quality.STALE
    assert running.value("supervision/pdo_age_ms") == 150
    names = {running.plant.image.points[index].leaf for index in feed.take(10_000)}
    assert "status_word" in names
    assert "pdo_age_ms" not in names, "ages are told a few times a second, however often they are read"
    running.plant.refresh(running.now)
    assert "pdo_age_ms" in {running.plant.image.points[index].leaf for index in feed.take(10_000)}


def test_before_it_is_heard_a_node_is_absent_and_has_no_fault(hall: Hall, tmp_path: Path):
    """Whether something of it is commanded or not."""
    for plant, node in ((hall.plant, "conveyor"), (device_plant(tmp_path, ENCODER), "shaft")):
        for leaf in ("state", "current_fault", "last_fault"):
            assert plant.image.read(f"{node}/node/{leaf}")[:2] == (0, Quality.GOOD)


def test_an_event_is_told_with_what_has_caused_it(hall: Hall):
    hall.plant.because = lambda event: "can0 is silent" if event.kind is EventKind.NODE_LOST else ""
    for state in (NodeState.OPERATIONAL, NodeState.LOST):
        node_goes(hall.plant, hall.node, state, hall.now)
    causes = {event.kind: event.cause for event in hall.events if event.source == "conveyor"}
    assert causes == {EventKind.NODE_BACK: "", EventKind.NODE_LOST: "can0 is silent"}


def test_a_node_has_the_state_that_the_bridge_gives_it(hall: Hall):
    codes = {NodeState.LOST: 3, NodeState.DISABLED: 5, NodeState.OPERATIONAL: 2}
    for state, code in codes.items():
        node_goes(hall.plant, hall.node, state, hall.now)
        assert hall.plant.image.read("conveyor/node/state").value == code


def test_a_node_whose_first_drive_has_no_process_data_is_not_as_configured(hall: Hall):
    """The boot-up leaves out a drive whose PDOs cannot be used; the node itself is in operation."""
    node_goes(hall.plant, hall.node, NodeState.OPERATIONAL, hall.now)
    first, second = hall.node.drives
    for drive, code in ((second, 2), (first, 6)):
        drive.channel.on_node(NodeState.CONFIG_ERROR, hall.now)
        hall.plant.settle()
        assert hall.plant.image.read("conveyor/node/state").value == code


def test_an_emergency_of_a_drive_without_data_is_known(hall: Hall):
    hall.drive.channel.on_emcy(emergency(0x8100), hall.now)
    reading = hall.read("status/emcy_code")
    assert (reading.value, reading.quality) == (0x8100, Quality.WAITING)
