"""The bridge takes a node out of operation itself: no drive of it runs on unless that is said. Judged by the
simulated drive's own motion, over families, transmission types and all who do it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Final

import pytest

from bridge.canopen.frame import Frame
from bridge.command import Action, Event, Identity, Outcome, Request, Role, Source, Start
from bridge.command.stop_check.state import LastStop
from bridge.config import load_site
from bridge.mapping import load_family
from bridge.sim.catalogue import simulate_node
from bridge.sim.cia402.cia402_drive import Cia402Drive
from bridge.sim.core.nmt_slave import SlaveState
from bridge.sim.lenze.lenze_motec import LenzeMotec
from bridge.sim.nord.nord_single import NordSingle
from bridge.sim.nord.nord_tu4 import NordTu4
from bridge.sim.stoeber.stoeber_5000 import Stoeber5000
from tests.support import sites
from tests.support.bench import PLC, Bench
from tests.support.nightly import by_night
from tests.unit.node.test_booting import Restart

FAMILIES: Final = (
    "cia402/velocity",
    "lenze/8400-motec",
    "nord/sk-54xe-rj45",
    "nord/sk-tu4-cao",
    "stoeber/5000",
)
ASYNCHRONOUS: Final = 255
"""What every factory has."""
TYPES: Final = (1, 10, ASYNCHRONOUS)
SYNC_S: Final = 0.01
IGNORED_S: Final = 1.0
SLACK_S: Final = 0.03
"""What the bridge waits beyond SYNC, and the time step of the tests."""
ENGINEER: Final = Identity(Source.OPCUA, "eve", Role.ENGINEER)
HEARTBEAT, SDO_REQUEST, RPDO = 0x705, 0x605, 0x205
SCALED: Final = {"P105": 50.0, "C00011": 1500.0, "C01": 3000.0, "reference": 1500.0}
OTHER: Final = """
[[bus.node]]
name = "m"
id = 9
mapping = "{mapping}"
on_loss = "stop_all"
[[bus.node.drive]]
slot = "{slot}"
"""


def speed(node: object) -> float:
    """Of the motor, in whatever unit."""
    match node:
        case NordTu4():
            return max(abs(drive.output_hz) for drive in node.drives)
        case NordSingle():
            return abs(node.drive.output_hz)
        case Stoeber5000():
            return max(abs(axis.speed_rpm) for axis in node.axes)
        case LenzeMotec():
            return abs(node.drive.speed_rpm)
        case Cia402Drive():
            return abs(node.axis.actual_rpm)
        case _:
            raise AssertionError(node)


class LastWords(Bench):
    """``node_is_deaf``: its RPDOs do not reach it any more."""

    node_is_deaf = False

    def _from_master(self, frame: Frame) -> None:
        if self.node_is_deaf and 0x200 <= frame.can_id < 0x580 and frame.can_id & 0x7F == 5:
            self.log.append(frame)
        else:
            super()._from_master(frame)


def moving(folder: Path, mapping: str, kind: int, *, node: str = "", bus: str = "") -> LastWords:
    """Its drive turns."""
    family = load_family(mapping)
    slot = family.slot[0].name
    full = {value.full for value in family.value if value.full}
    scaled = ", ".join(f'"{name}" = {SCALED.get(name, 1500.0)}' for name in sorted(full))
    more = f"parameters = {{ {scaled} }}\nignored_stop_ms = {round(IGNORED_S * 1000)}\n"
    if kind != ASYNCHRONOUS:
        more += f"rpdo = {{ transmission_type = {kind} }}"
    if mapping.startswith("stoeber/"):
        more += "\ntpdo = { event_ms = 50 }"
    supervision = "guarding" if mapping.startswith("stoeber/") else "heartbeat"
    table = sites.node(
        sites.drive(slot, "modbus", 0, more),
        name="n",
        mapping=mapping,
        more=f'supervision = "{supervision}"\n{node}',
    )
    other = OTHER.format(mapping=mapping, slot=slot)
    site = load_site(sites.write(folder, sites.bus(table, other, more=bus), sites.modbus()))
    bench = LastWords(site, family=family, mapping=mapping, node=simulate_node(mapping, 5, {}))
    bench.run(2.5)
    (name, *_) = bench.plant.drives
    outcomes: list[Outcome] = []
    bench.view.submit(Request(PLC, name, Start(direction=0)), outcomes.append)
    bench.run(3.1)
    assert [outcome.ok for outcome in outcomes] == [True], outcomes
    bench.write(name, setpoint_1=400 if mapping.startswith("cia402/") else 0x1000)
    bench.run(1.0)
    assert speed(bench.node) > 0
    bench.log.clear()
    bench.events.clear()
    return bench


def foreign_heartbeat(bench: LastWords) -> None:
    bench.receive(Frame(0x77F, b"\5"))


def foreign_sdo(bench: LastWords) -> None:
    bench.receive(Frame(SDO_REQUEST, bytes.fromhex("2300140105020080")))


def operator(action: Action) -> Callable[[LastWords], None]:
    def ask(bench: LastWords) -> None:
        assert bench.ask(action, "n", ENGINEER).ok

    return ask


def operator_of_the_bus(bench: LastWords) -> None:
    assert bench.ask(Action.STOP_NODE, "bus/can0", ENGINEER).ok


def loss_of_another(bench: LastWords) -> None:
    bench.network.stop_others(bench.network.nodes[1], "m is lost", bench.now)


def loss(bench: LastWords) -> None:
    """Only the node's error control is gone."""
    bench.network.nodes[0]._lose("E: lost", bench.now)
    bench.network.touched(bench.network.nodes[0])


CALLERS: Final[dict[str, Callable[[LastWords], None]]] = {
    "foreign heartbeat": foreign_heartbeat,
    "foreign SDO": foreign_sdo,
    "operator's stop": operator(Action.STOP_NODE),
    "operator's pre-operational": operator(Action.ENTER_PRE_OPERATIONAL),
    "operator of the bus": operator_of_the_bus,
    "another is lost, stop_all": loss_of_another,
    "lost, stop_node": loss,
}
LOSS: Final = 'on_loss = "stop_node"'
SOME: Final = ("foreign heartbeat", "another is lost, stop_all")
CASES: Final = [
    (mapping, kind, caller)
    for mapping in FAMILIES
    for kind in TYPES
    for caller in (CALLERS if mapping == "lenze/8400-motec" else SOME)
]
"""All callers where NMT stop does nothing to the drive."""


def worst(bench: Bench) -> list[Event]:
    return [event for event in bench.events if event.severity == 1000]


def named(bench: Bench) -> bool:
    drive = next(iter(bench.plant.drives.values()))
    is_said = [event.source for event in worst(bench)] == [drive.name]
    return is_said and not drive.stop_check.follows and drive.stop_check.last_stop is LastStop.IGNORED


def leaves_at(bench: Bench) -> list[float]:
    """When the node was told to leave Operational."""
    told = [frame for frame in bench.log if not frame.can_id and frame.data[1] in (0, 5)]
    return [frame.time for frame in told if frame.data[0] in (0x02, 0x80)]


@pytest.mark.landing(9)
@pytest.mark.parametrize(("mapping", "kind", "caller"), by_night(CASES))
def test_a_drive_that_hears_us_stops(tmp_path: Path, mapping: str, kind: int, caller: str) -> None:
    bench = moving(tmp_path, mapping, kind, node=LOSS if caller.startswith("lost") else "")
    begin = bench.now
    CALLERS[caller](bench)
    bench.run(0.2)
    sync_s = kind * SYNC_S + SLACK_S if kind <= 240 else 0.0
    assert leaves_at(bench), "the node is told to leave Operational in any case"
    assert begin <= leaves_at(bench)[0] <= begin + sync_s + 1e-6
    bench.run(3.0)
    assert speed(bench.node) == 0


@pytest.mark.landing(9)
@pytest.mark.parametrize(("mapping", "kind", "caller"), by_night(CASES))
def test_a_deaf_drive_stops_by_the_command_or_is_named(
    tmp_path: Path, mapping: str, kind: int, caller: str
) -> None:
    bench = moving(tmp_path, mapping, kind, node=LOSS if caller.startswith("lost") else "")
    bench.node_is_deaf = True
    CALLERS[caller](bench)
    bench.run(IGNORED_S + 1.3)
    if mapping.startswith("cia402/") and "pre-op" not in caller and "lost" not in caller:
        assert not worst(bench), "it has said that it is in Stopped, where its drive does not run"
    assert named(bench) or not speed(bench.node)
    assert len(worst(bench)) <= 1


@pytest.mark.landing(4)
@pytest.mark.parametrize("kind", TYPES)
@pytest.mark.parametrize("mapping", FAMILIES)
def test_who_says_in_time_that_it_follows_is_not_named(tmp_path: Path, mapping: str, kind: int) -> None:
    """A synchronous RPDO leaves it the time for that."""
    bench = moving(tmp_path, mapping, kind)
    (drive, *_) = bench.plant.drives.values()
    CALLERS["operator's stop"](bench)
    bench.run(3.0)
    if drive.stop_check.last_stop is LastStop.FOLLOWED:
        assert not worst(bench) and drive.stop_check.follows
    else:
        assert named(bench) and "may run on" in worst(bench)[0].message


# what may come while the command waits


def test_a_foreign_sync_that_does_not_come_holds_nothing_up_for_long(tmp_path: Path) -> None:
    bench = moving(tmp_path, "lenze/8400-motec", ASYNCHRONOUS, bus="sync_period_ms = 0")
    begin = bench.now
    next(iter(bench.plant.drives.values())).rpdo_type = 1
    CALLERS["foreign heartbeat"](bench)
    bench.run(0.3)
    assert begin + 0.1 <= leaves_at(bench)[0] <= begin + 0.13


@pytest.mark.landing(10)
@pytest.mark.parametrize("kind", [1, 10])
@pytest.mark.parametrize("mapping", FAMILIES)
def test_a_restarted_bridge_that_cannot_boot_the_node_stops_it(
    tmp_path: Path, mapping: str, kind: int
) -> None:
    rpdo = f"rpdo = {{ transmission_type = {kind} }}"
    if mapping.startswith("stoeber/"):
        rpdo += "\ntpdo = { event_ms = 50 }"
    restart = Restart(
        tmp_path, mapping, before=rpdo, after=rpdo, node="[bus.node.identity]\nvendor_id = 0x123"
    )
    assert restart.stopped_s(0.5) is not None


def test_who_asks_again_and_again_puts_nothing_off(tmp_path: Path) -> None:
    bench = moving(tmp_path, "lenze/8400-motec", 10)
    begin = bench.now
    for _ in range(20):
        bench.ask(Action.STOP_NODE, "n", ENGINEER)
        bench.run(0.01)
    assert leaves_at(bench)[0] <= begin + 10 * SYNC_S + SLACK_S


def test_stopped_words_go_on_while_it_waits(tmp_path: Path) -> None:
    bench = moving(tmp_path, "lenze/8400-motec", 10)
    CALLERS["foreign heartbeat"](bench)
    bench.run(0.1)
    assert not leaves_at(bench)
    (drive, *_) = bench.plant.drives.values()
    words = [int.from_bytes(frame.data[:2], "little") for frame in bench.log if frame.can_id == RPDO]
    assert len(words) > 5 and not any(map(drive.channel.words.enables, words))


def test_started_again_meanwhile_it_is_stopped_first_and_then_booted(tmp_path: Path) -> None:
    bench = moving(tmp_path, "lenze/8400-motec", 10)
    bench.ask(Action.STOP_NODE, "n", ENGINEER)
    bench.run(0.02)
    bench.ask(Action.START_NODE, "n", ENGINEER)
    bench.run(4.0)
    commands = [frame.data[0] for frame in bench.log if not frame.can_id]
    assert commands[:2] == [0x02, 0x80]
    assert bench.node.slave.state is SlaveState.OPERATIONAL
    assert speed(bench.node) == 0


def test_a_process_that_comes_late_leaves_the_sync_time_to_come(tmp_path: Path) -> None:
    """In the bench SYNC is sent by the process: none has gone out during the hang."""
    bench = moving(tmp_path, "lenze/8400-motec", 1)
    CALLERS["operator's stop"](bench)
    bench.run(0.001)
    bench.now += 0.06
    bench.run(6.0)
    assert speed(bench.node) == 0


def test_a_bus_that_goes_meanwhile_does_not_lose_the_stop(tmp_path: Path) -> None:
    bench = moving(tmp_path, "cia402/velocity", 10)
    CALLERS["operator's stop"](bench)
    bench.run(0.02)
    bench.network.bus_is_gone(bench.now)
    bench.run(0.3)
    assert not leaves_at(bench)
    bench.network.bus_is_back(bench.now)
    bench.run(0.5)
    assert leaves_at(bench) and bench.node.slave.state is SlaveState.STOPPED


def test_a_drive_that_ignores_its_stop_gets_its_nmt_stop_at_once(tmp_path: Path) -> None:
    bench = moving(tmp_path, "lenze/8400-motec", 10)
    bench.node_is_deaf = True
    (drive, *_) = bench.plant.drives.values()
    bench.ask(Action.STOP, drive.name)
    bench.run(IGNORED_S + 0.5)
    [event] = worst(bench)
    assert leaves_at(bench)[0] <= event.time + 0.01
