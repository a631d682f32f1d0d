"""Silence is a stop only as long as the drive is known to watch its own process data: judged at boot-up by
what the drive holds, and again when that is written."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.canopen.frame import Frame
from bridge.command import Action, Code, Event, Identity, Outcome, Request, Role, Source, WriteParameter
from bridge.command.messages.request import STOP_ACTIONS
from bridge.command.worst_case import stop_time
from bridge.config import load_site
from bridge.drive import DriveState
from bridge.image import Quality
from bridge.mapping import load_family
from bridge.mapping.loader import family_names, mapping_folders
from bridge.sim.catalogue import simulate_node
from tests.support import sites
from tests.support.bench import Bench
from tests.support.nightly import by_night

ENGINEER = Identity(Source.OPCUA, "eve", Role.ENGINEER)
FAMILIES = list(family_names(mapping_folders(Path("site.toml"))))
SLOTS = [(name, slot.name) for name in FAMILIES for slot in load_family(name).slot]
ON = "own_timeout_ms = 300\nenforce = true"
NODES = [(*one, ON) for one in SLOTS if not one[0].startswith("stoeber")]  # life guarding alone (§9.4)
NODES += [(name, load_family(name).slot[-1].name, "") for name in FAMILIES]
SILENCE, THEN_SILENCE = 'on_expiry = "silence"', 'on_expiry = "stop"\nthen_silence_ms = 100'
TU4 = "nord/sk-tu4-cao"
TIMEOUT_S = 0.2


class Silent(Bench):
    """One drive whose site stops it by silence, and a controller that commands it."""

    def __init__(self, folder: Path, mapping: str, slot: str, drive: str, node: str = "", **held: float):
        whole = sites.node(
            sites.drive(slot, "modbus", round(1000 * TIMEOUT_S), drive), name="n", mapping=mapping, more=node
        )
        # `load_project` refuses what is vain by the site file: a drive may be set otherwise than that says.
        site = load_site(sites.write(folder, sites.bus(whole), sites.modbus()))
        simulated = simulate_node(mapping, 5, held)
        super().__init__(site, family=load_family(mapping), mapping=mapping, node=simulated)
        self.run(2.0)
        (self.name,) = self.plant.drives
        self.drive = self.plant.drives[self.name]
        assert str(self.value("n/node/boot_status")).startswith("ok"), self.value("n/node/boot_status")

    def let_its_owner_die(self, seconds: float = 0.5) -> None:
        """The timer runs from the first telegram, whether the drive is enabled or not."""
        assert self.write(self.name, control_word=self.drive.channel.words.stopped).ok
        self.run(seconds)

    def run_the_drive(self) -> None:
        for word in (0x047E, 0x047E, 0x047F, 0x047F):
            assert self.write(self.name, control_word=word, setpoint_1=0x2000 if word & 1 else 0).ok
            self.run(0.1)
        assert self.drive.channel.state is DriveState.OPERATION_ENABLED

    def rpdos(self, seconds: float) -> int:
        """How many RPDOs the drive gets in this time."""
        del self.log[:]
        self.run(seconds)
        (pdos,) = self.network.nodes[0].wire.drives.values()
        identifiers = {rpdo.cob_id for rpdo in pdos.rpdos}
        return sum(frame.can_id in identifiers for frame in self.log)

    def set(self, parameter: str, value: float, identity: Identity = ENGINEER) -> Outcome:
        outcomes: list[Outcome] = []
        request = Request(identity, self.name, WriteParameter(parameter=parameter, value=value))
        self.view.submit(request, outcomes.append)
        self.run(0.5)
        (outcome,) = outcomes
        return outcome

    def told(self) -> list[Event]:
        return [event for event in self.events if "silence does not stop" in event.message]

    @property
    def stop_ms(self) -> int:
        point = self.plant.image.read(f"{self.name}/supervision/worst_case_stop_ms")
        assert point.quality is Quality.GOOD, point.reason
        assert isinstance(point.value, int)
        return point.value


@pytest.mark.landing(23)
@pytest.mark.parametrize(
    ("mapping", "slot", "node", "drive"),
    by_night((*node, drive) for node in NODES for drive in (SILENCE, THEN_SILENCE)),
)
def test_who_does_not_watch_its_process_data_is_told_to_stop(
    tmp_path: Path, mapping: str, slot: str, node: str, drive: str
) -> None:
    """At factory no drive stops by its own watch; with a time of its own it does where it has one."""
    bench = Silent(tmp_path, mapping, slot, drive, node)
    own = bench.drive.own
    assert own is not None
    bench.let_its_owner_die()
    assert bench.number(f"{bench.name}/supervision/watchdog_state") == 3
    if own.process_data_ms:
        assert node
        assert not bench.told()
        assert not bench.rpdos(0.3)
        assert bench.stop_ms == plain_ms(bench) + (own.process_data_ms if drive == SILENCE else 0)
        return
    (event,) = bench.told()
    assert (event.source, event.severity) == (bench.name, 700)
    assert bench.rpdos(0.3) > 10
    words = bench.drive.channel.words
    sent = bench.drive.channel.output.words[0]
    assert sent == words.disable_voltage(sent)
    assert not words.enables(sent)
    assert bench.stop_ms == plain_ms(bench)


def plain_ms(bench: Silent) -> int:
    """The published time of the same drive with disable voltage."""
    drive = bench.drive
    plain = drive.table.model_copy(update={"on_expiry": "disable_voltage"})
    return stop_time(plain, drive.bus, round(1000 * TIMEOUT_S), drive.rpdo_type, drive.wire).ms


@pytest.mark.landing
def test_a_drive_that_is_set_otherwise_stops_in_the_published_time(tmp_path: Path) -> None:
    bench = Silent(tmp_path, TU4, "fu1", SILENCE, P151=0.0)
    bench.run_the_drive()
    last = bench.now - 0.1
    bench.run(0.5)
    assert bench.drive.channel.state is not DriveState.OPERATION_ENABLED
    enabling = [frame for frame in bench.sent(0x205) if frame.data[0] & 0x0F == 0x0F]
    assert enabling[-1].time - last <= bench.stop_ms / 1000
    assert bench.value(f"{bench.name}/supervision/follows") is True
    (trip,) = [event for event in bench.events if "was silent for 200 ms" in event.message]
    assert "200 ms: disable voltage" in trip.message


@pytest.mark.landing(2)
@pytest.mark.parametrize("drive", [SILENCE, THEN_SILENCE])
def test_a_watch_that_is_changed_while_the_bridge_runs_counts_no_more(tmp_path: Path, drive: str) -> None:
    bench = Silent(tmp_path, TU4, "fu1", drive, P151=300.0)
    assert bench.stop_ms == plain_ms(bench) + (300 if drive == SILENCE else 0)
    assert bench.set("P151", 20000).ok
    (event,) = bench.told()
    assert "P151 was changed since boot" in event.message
    assert bench.stop_ms == plain_ms(bench)
    bench.run_the_drive()
    bench.run(1.0)
    assert bench.drive.channel.state is not DriveState.OPERATION_ENABLED
    assert bench.rpdos(0.3) > 10
    assert bench.set("P151", 10000).ok
    assert len(bench.told()) == 1, "once"


def test_the_next_boot_up_reads_it_again(tmp_path: Path) -> None:
    bench = Silent(tmp_path, TU4, "fu1", SILENCE, P151=300.0)
    assert bench.set("P151", 400).ok
    assert bench.told()
    bench.receive(Frame(0x705, b"\0"))
    bench.run(2.0)
    assert bench.stop_ms == plain_ms(bench) + 400
    bench.let_its_owner_die()
    assert not bench.rpdos(0.3)


def test_before_the_drive_is_asked_its_time_is_not_known(tmp_path: Path) -> None:
    bench = Silent(tmp_path, TU4, "fu1", SILENCE, P151=300.0)
    bench.drive.own = None
    assert "has not been read yet" in str(bench.drive.stop_time().unknown)


OFF = [
    (TU4, "fu1", "P151", 0.0, {"P151": 300.0}),
    (TU4, "fu1", "P513", -0.1, {"P151": 300.0}),
    ("nord/sk-tu3-cao", None, "P513", 0.0, {"P513": 0.5}),
    ("nord/sk-tu3-cao", None, "P513", -0.1, {"P513": 0.5}),
    ("lenze/8400-motec", None, "C00357/1", 0.0, {"C00593/1": 1.0, "C00357/1": 400.0}),
    ("lenze/8400-motec", None, "C00593/1", 0.0, {"C00593/1": 1.0, "C00357/1": 400.0}),
    ("lenze/8400-motec", None, "C00593/1", 4.0, {"C00593/1": 1.0, "C00357/1": 400.0}),
]


@pytest.mark.landing(4)
@pytest.mark.parametrize("drive", [SILENCE, THEN_SILENCE])
@pytest.mark.parametrize(("mapping", "slot", "parameter", "value", "held"), OFF)
def test_the_watch_is_not_switched_off_while_silence_is_to_stop_the_drive(
    tmp_path: Path,
    mapping: str,
    slot: str | None,
    parameter: str,
    value: float,
    held: dict[str, float],
    drive: str,
) -> None:
    slot = slot or load_family(mapping).slot[0].name
    bench = Silent(tmp_path, mapping, slot, drive, "", **held)
    refused = bench.set(parameter, value)
    assert refused.code is Code.NOT_ALLOWED
    assert f"{parameter} would end the watch by which silence stops {bench.name}" in refused.message
    assert not bench.told()
    assert bench.drive.own is not None
    assert bench.drive.own.process_data_ms
    plain = Silent(tmp_path, mapping, slot, 'on_expiry = "stop"', "", **held)
    assert plain.set(parameter, value).ok, "nothing depends on it there"


def test_of_a_write_that_nobody_answered_the_watch_is_not_known(tmp_path: Path) -> None:
    bench = Silent(tmp_path, TU4, "fu1", SILENCE, "sdo_timeout_ms = 100\nsdo_retries = 0", P151=300.0)
    bench.deaf_to = frozenset({0x585})
    assert bench.set("P151", 30000).code is Code.TIMED_OUT
    (event,) = bench.told()
    assert "P151" in event.message
    assert bench.stop_ms == plain_ms(bench)


@pytest.mark.landing(6)
@pytest.mark.parametrize("drive", [SILENCE, THEN_SILENCE])
@pytest.mark.parametrize("action", sorted(STOP_ACTIONS))
def test_a_stop_by_anybody_is_on_the_bus_though_the_drive_gets_nothing_any_more(
    tmp_path: Path, drive: str, action: Action
) -> None:
    """As one burst: then the drive's own P151 trips all the same (BU 2500 §7.1.1)."""
    bench = Silent(tmp_path, TU4, "fu1", drive, P151=300.0)
    bench.run_the_drive()
    bench.run(0.25)
    assert not bench.rpdos(0.03)
    assert bench.ask(action, bench.name, ENGINEER) == Outcome(Code.OK)
    assert 2 <= bench.rpdos(0.2) <= 12
    assert not any(bench.drive.channel.words.enables(frame.data[0]) for frame in bench.sent(0x205))
    assert not bench.rpdos(0.3)
    assert not bench.ask(action, bench.name, ENGINEER).forwarded
    assert not bench.rpdos(0.5)
    assert bench.drive.channel.state is DriveState.FAULT, "P151 has tripped"
