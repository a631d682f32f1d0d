"""Drives of all families follow their stops, and none of them is called ignoring. On a virtual clock."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.command import Action, Outcome, Request, Start
from bridge.command.stop_check.state import LastStop
from bridge.config import load_site
from bridge.drive import ControlWords, DriveState
from bridge.mapping import load_family
from bridge.sim.catalogue import simulate_node
from tests.support import sites
from tests.support.bench import PLC, Bench

FAMILIES = (
    "nord/sk-tu4-cao",
    "nord/sk-tu4-cao-ds402",
    "nord/sk-5xxe-rj45",
    "lenze/8400-motec",
    "stoeber/5000",
    "cia402/velocity",
    "cia402/profile-velocity",
)
STOPS = (Action.STOP, Action.QUICK_STOP, Action.DISABLE_VOLTAGE)
SCALED = {"P105": 50.0, "P112": 10.0, "C00011": 1500.0, "C01": 3000.0}
SPEED = {"nord/sk-tu4-cao-ds402": 600, "cia402/velocity": 600, "stoeber/5000": 500}


def a_bench(folder: Path, mapping: str) -> Bench:
    family = load_family(mapping)
    full = {value.full: SCALED[value.full] for value in family.value if value.full in SCALED}
    scaled = ", ".join(f"{name} = {number}" for name, number in full.items())
    drive = sites.drive(family.slot[0].name, "modbus", 0, f"parameters = {{ {scaled} }}")
    kind = "guarding" if mapping.startswith("stoeber/") else "heartbeat"
    node = sites.node(drive, mapping=mapping, more=f'supervision = "{kind}"')
    site = load_site(sites.write(folder, sites.bus(node), sites.modbus(), name="bench"))
    bench = Bench(site, family=family, mapping=mapping, node=simulate_node(mapping, 5, {}))
    bench.run(1.5)
    return bench


@pytest.mark.landing(3)
@pytest.mark.parametrize("mapping", FAMILIES)
def test_every_family_follows_every_stop(tmp_path: Path, mapping: str) -> None:
    bench = a_bench(tmp_path, mapping)
    (drive,) = bench.plant.drives.values()
    for stop in STOPS:
        outcomes: list[Outcome] = []
        request = Request(PLC, drive.name, Start(direction=0))
        bench.view.submit(request, outcomes.append)
        bench.run(3.1 if mapping.startswith("lenze/") else 0.7)
        assert [outcome.ok for outcome in outcomes] == [True], (stop, outcomes)
        bench.write(drive.name, setpoint_1=SPEED.get(mapping, 0x2000))
        bench.run(0.8)
        assert drive.channel.state is DriveState.OPERATION_ENABLED
        bench.ask(stop, drive.name)
        assert drive.stop_check.last_stop is LastStop.FORWARDED
        bench.run(2.5)
        assert drive.stop_check.last_stop is LastStop.FOLLOWED, stop
    assert max(event.severity for event in bench.events) < 1000


@pytest.mark.parametrize("mapping", FAMILIES)
def test_which_words_take_the_voltage(mapping: str) -> None:
    model = load_family(mapping).control_word
    words = ControlWords(model)
    running = model.run | model.forward
    assert words.enables(running)
    assert not words.takes_voltage(running)
    assert words.takes_voltage(words.disable_voltage(running))
    assert words.takes_voltage(model.stopped)
    assert not words.takes_voltage(words.stop(running)), "perhaps a ramp"
    assert not words.takes_voltage(words.quick_stop(running)), "perhaps a ramp"
