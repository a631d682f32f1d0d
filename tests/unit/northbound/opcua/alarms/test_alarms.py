"""Alarms as they follow what the bus process judges: one for each place, one cause each; clocks by hand."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from asyncua import ua

from bridge.catalogue.codes import NODE_STATES
from bridge.condition.told import MOST, troubles_json
from bridge.image import Quality
from bridge.northbound.opcua.alarms.alarm_contents import AlarmContents
from bridge.northbound.opcua.alarms.alarm_file import AlarmFile
from bridge.northbound.opcua.alarms.alarm_nodes import Alarm
from bridge.northbound.opcua.alarms.alarm_places import CERTIFICATE, alarm_places
from bridge.northbound.opcua.alarms.alarms import Alarms
from bridge.northbound.trouble_reader import TroubleReader
from bridge.northbound.trouble_words import PlantWords
from bridge.uaserver.conditions.condition import Act
from bridge.uaserver.conditions.condition_fields import ConditionPlace, ConditionWords, common_fields
from bridge.uaserver.conditions.conditions import Condition, Conditions
from bridge.uaserver.library import text
from bridge.uaserver.subscriptions.subscriptions import Subscriptions
from tests.support import sites
from tests.support.condition import Watched

NODES = [f"n{number}" for number in range(1, 11)]
DRIVES = [f"{node}/fu{number}" for node in NODES for number in range(1, 5)]
_SITE = sites.site(
    sites.bus(
        *(
            sites.node(
                *(sites.drive(f"fu{one}", "lease", 1000) for one in range(1, 5)), name=node, node_id=number
            )
            for number, node in enumerate(NODES, 2)
        )
    )
)
BUS = "bus/can0/Alarm"
_CODES = {name: code for code, name in NODE_STATES}
LOST, OPERATIONAL = _CODES["lost"], _CODES["operational"]
YEAR_MS = 365 * 86_400_000.0


class Bench:
    """A plant of forty drives, judged, and its alarms. ``told`` are alarms in the order of their events, with
    whether they were active."""

    def __init__(self, folder: Path) -> None:
        self.plant = Watched(_SITE)
        self.file = AlarmFile(folder)
        self.expires_ms = 10 * YEAR_MS
        self.begin()

    def begin(self) -> None:
        """As a front that has just been started."""
        subscriptions = SimpleNamespace(subscriptions={})
        self.conditions = Conditions(
            cast("Subscriptions", subscriptions), cast("Any", None), ConditionWords(text), lambda: self.now_ms
        )
        contents = AlarmContents(self.plant.image, PlantWords(), 2)
        notifiers = ["bus/can0", *NODES, *DRIVES, "bridge"]
        self.alarms = [
            Alarm(place, self._condition(place.id, contents), ua.NodeId(Ids.AlarmConditionType))
            for place in alarm_places(notifiers, ("modbus", "zenoh"))
        ]
        self.by_id = {one.place.id: one.condition for one in self.alarms}
        reader = TroubleReader(self.plant.image, lambda: self.now_ms)

        expires = datetime.fromtimestamp(self.expires_ms / 1000, UTC)
        self.followed = Alarms(
            reader,
            self.conditions,
            contents,
            self.alarms,
            expires,
            lambda: self.now_ms / 1000,
            lambda: self.now_ms,
        )
        self.followed.restore(self.file)

    def _condition(self, name: str, contents: AlarmContents) -> Condition:
        where = ua.NodeId(name, 2)
        common = common_fields(where, "Alarm", Ids.ProcessConditionClassType, text("process"), {})
        place = ConditionPlace(where, where, name, (where,), common)
        condition = Condition(place, content=contents.nothing)
        self.conditions.add(condition)
        return condition

    @property
    def now_ms(self) -> float:
        return self.plant.now_ms

    def later(self, seconds: float = 5.0) -> None:
        """The bus process judges twice a second, and the alarms follow."""
        for _ in range(int(seconds * 2)):
            self.plant.later(500.0)
            self.plant.set("bridge/troubles", troubles_json(self.plant.troubles.shown))
            self.plant.set("bridge/drives_waiting", self.plant.troubles.waiting)
            self.followed.look()

    def told(self) -> list[tuple[str, bool]]:
        waiting = self.conditions._waiting
        found = [(fields["SourceName"].Value, fields["ActiveState/Id"].Value) for _, fields in waiting]
        waiting.clear()
        return found

    @property
    def active(self) -> list[str]:
        return [name for name, one in self.by_id.items() if one.state.active]

    def says(self, name: str, field: str) -> Any:
        fields = self.conditions.fields(self.by_id[name])
        return fields[field if field in fields else f"2:{field}"].Value

    def nodes_go(self, state: int) -> None:
        for node in NODES:
            self.plant.set(f"{node}/node/state", state)

    def acknowledge(self, name: str) -> None:
        condition = self.by_id[name]
        step = condition.state.acknowledge(Act(condition.event_id, user="anna"), self.now_ms)
        assert not step.code
        condition.state = step.state

    def keep(self) -> None:
        self.file.save(self.followed.kept())


Ids = ua.ObjectIds


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    made = Bench(tmp_path)
    made.later()
    assert made.active == []
    return made


def test_a_cut_bus_under_forty_drives_is_one_alarm_and_gone_when_it_is_back(bench: Bench) -> None:
    bench.nodes_go(LOST)
    bench.later()
    assert bench.active == [BUS]
    assert set(bench.says(BUS, "Explains")) == set(NODES)
    message = bench.says(BUS, "Message").words
    assert message["en"].startswith("No node answers. All 10 nodes")
    assert message["de"].startswith("Kein Knoten antwortet. Alle 10 Knoten")
    assert {place for place, _ in bench.told()} == {BUS}
    bench.nodes_go(OPERATIONAL)
    bench.later(70.0)
    assert bench.active == []
    assert not bench.by_id[BUS].state.acked, "somebody has to see it all the same"
    assert bench.told() == [(BUS, False)]


def test_drives_that_are_missed_before_their_bus_raise_no_alarm(bench: Bench) -> None:
    """Deadlines of process data run out before nodes are supervised."""
    for drive in DRIVES:
        bench.plant.set(f"{drive}/status/state", 0, Quality.LOST)
    bench.later(1.0)
    assert bench.told() == []
    bench.nodes_go(LOST)
    bench.later()
    assert bench.told() == [(BUS, True)]


def test_a_drive_alone_that_is_not_heard_is_an_alarm_soon_after(bench: Bench) -> None:
    bench.plant.set("n1/fu1/status/state", 0, Quality.LOST)
    bench.later(1.0)
    assert bench.told() == []
    bench.later(2.0)
    assert bench.told() == [("n1/fu1/Alarm", True)]


def test_independent_troubles_are_alarms_of_their_own(bench: Bench) -> None:
    for node in ("n3", "n7"):
        bench.plant.set(f"{node}/node/state", LOST)
    bench.later()
    assert bench.active == ["n3/Alarm", "n7/Alarm"]


def test_the_worst_at_a_place_speaks_and_another_one_is_to_be_seen_anew(bench: Bench) -> None:
    bus = "bus/can0"
    bench.plant.set(f"{bus}/unexpected_nodes", "77")
    bench.later()
    assert (bench.says(BUS, "Severity"), bench.says(BUS, "Code")) == (400, "condition.unexpected_nodes")
    bench.acknowledge(BUS)
    bench.plant.set(f"{bus}/duplicate_ids", "5")
    bench.later()
    assert (bench.says(BUS, "Severity"), bench.says(BUS, "LastSeverity")) == (800, 400)
    assert not bench.by_id[BUS].state.acked
    bench.acknowledge(BUS)
    bench.plant.set(f"{bus}/duplicate_ids", "5, 9")
    bench.later()
    assert bench.says(BUS, "Facts") == '{"ids":"5, 9"}'
    assert bench.by_id[BUS].state.acked, "it is the same one, which says something else"


def test_what_changes_all_the_time_is_told_once_a_second(bench: Bench) -> None:
    bench.told()
    for number in range(20):
        bench.plant.set("bus/can0/unexpected_nodes", str(number + 20))
        bench.later(0.5)
    assert 8 <= len(bench.told()) <= 12


def test_while_the_bus_process_is_dead_the_bridge_says_so_and_the_rest_stays(bench: Bench) -> None:
    bench.plant.set("n3/node/state", LOST)
    bench.later()
    image = bench.plant.image
    readings = {name: image.read(name) for name in image.index if name.startswith("bridge/")}
    for name, reading in readings.items():
        bench.plant.set(name, reading.value, Quality.DEAD)
    bench.followed.look()
    assert bench.active == ["n3/Alarm", "bridge/Alarm"]
    assert bench.says("bridge/Alarm", "Code") == "condition.bridge_dead"
    for name, reading in readings.items():
        bench.plant.set(name, reading.value)
    bench.plant.set("bridge/troubles", "[]")
    bench.followed.look()
    assert bench.active == ["n3/Alarm"], "a bus process that has just begun does not know yet"
    bench.later()
    assert bench.active == ["n3/Alarm"]


class TestRestart:
    def test_what_was_acknowledged_stays_so(self, bench: Bench) -> None:
        bench.plant.set("n3/node/state", LOST)
        bench.later()
        bench.acknowledge("n3/Alarm")
        bench.keep()
        bench.begin()
        assert bench.active == ["n3/Alarm"]
        assert bench.says("n3/Alarm", "Message").words["de"].startswith("Nicht mehr erreichbar.")
        bench.later(20.0)
        state = bench.by_id["n3/Alarm"].state
        assert (state.active, state.acked, state.confirmed) == (True, True, False)

    def test_what_is_over_since_is_over_once_the_drives_have_told_their_state(self, bench: Bench) -> None:
        bench.plant.set("n3/node/state", LOST)
        bench.later()
        bench.keep()
        bench.plant.set("n3/node/state", OPERATIONAL)
        bench.later()
        bench.begin()
        bench.later(9.0)
        assert bench.active == ["n3/Alarm"]
        bench.later(2.0)
        assert bench.active == []

    def test_an_alarm_whose_file_does_not_say_what_it_was_is_over_then(self, bench: Bench) -> None:
        bench.plant.set("n3/node/state", LOST)
        bench.later()
        bench.keep()
        content = bench.file.path.read_text().replace('"kind":"node_lost"', '"kind":7')
        bench.file.path.write_text(content.replace('"facts"', '"fax"'))
        bench.plant.set("n3/node/state", OPERATIONAL)
        bench.later()
        bench.begin()
        bench.later(12.0)
        assert bench.active == []


def test_a_certificate_is_an_alarm_for_its_last_month(bench: Bench) -> None:
    certificate = f"bridge/{CERTIFICATE.title()}Alarm"
    bench.plant.now_ms = bench.expires_ms - 31 * 86_400_000
    bench.followed.look()
    assert bench.active == []
    bench.plant.now_ms += 2 * 86_400_000
    bench.followed.look()
    assert bench.active == [certificate]
    assert "1979-12-30" in bench.says(certificate, "Message").words["de"]


def test_no_alarm_is_over_because_there_is_more_to_tell(bench: Bench) -> None:
    """The list of troubles ends with the hundredth."""
    bench.plant.set("n3/node/state", LOST)
    bench.later()
    one = {"rank": "danger", "kind": "ignores_stop", "place": "n5/fu1", "since": 1, "facts": {}}
    bench.plant.set("bridge/troubles", json.dumps([one] * MOST))
    bench.followed.look()
    assert bench.active == ["n3/Alarm", "n5/fu1/Alarm"]
    bench.plant.set("bridge/troubles", json.dumps([one] * (MOST - 1)))
    bench.followed.look()
    assert bench.active == ["n5/fu1/Alarm"]
