"""Simulated drives of every family whose owner jogs: deaf ones are named, the others never. Virtual clock."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.canopen.frame import Frame
from bridge.command import Action, Event, Request, command_of
from bridge.config import load_site
from bridge.mapping import load_family
from bridge.sim.catalogue import simulate_node
from tests.support import sites
from tests.support.bench import PLC, Bench

RUN_S, STOP_S = 1.0, 0.4
NAMED_S = 160.0
"""15 s of ramp, of which each stop shows 0.2 s: the published bound, a start of 0.1 s each time added."""
SPEEDS = {
    "nord/sk-tu4-cao": ("frequency", 40.0),
    "nord/sk-tu3-cao": ("frequency", 40.0),
    "nord/sk-tu4-cao-ds402": ("velocity", 1200),
    "lenze/8400-motec": ("velocity", 1200.0),
    "stoeber/5000": ("velocity", 1200.0),
    "cia402/velocity": ("velocity", 1200),
    "cia402/profile-velocity": ("velocity", 100_000),
    "cia402/cyclic-velocity": ("velocity", 100_000),
}


class DeafBench(Bench):
    """Whose node gets no process data any more while it ``is_deaf``."""

    is_deaf = False

    def _from_master(self, frame: Frame) -> None:
        if self.is_deaf and 0x200 <= frame.can_id < 0x580:
            self.log.append(frame)
        else:
            super()._from_master(frame)

    def start(self, drive: str) -> None:
        """The outcome comes when the drive says that it is enabled."""
        self.view.submit(Request(PLC, drive, command_of(Action.START)), lambda outcome: None)

    def jog(self, drive: str, seconds: float) -> None:
        end = self.now + seconds
        while self.now < end and not self.worst:
            self.ask(Action.STOP, drive)
            self.run(STOP_S)
            self.start(drive)
            self.run(RUN_S)

    @property
    def worst(self) -> list[Event]:
        return [event for event in self.events if event.severity == 1000]


def running(folder: Path, mapping: str) -> tuple[DeafBench, str]:
    family = load_family(mapping)
    known = {"P105": 50.0, "P112": 10.0, "C00011": 1500.0, "C01": 3000.0}
    full = sorted({value.full for value in family.value if value.full} & set(known))
    more = f"parameters = {{ {', '.join(f'{one} = {known[one]}' for one in full)} }}\ntelegram_downtime_s = 0"
    if mapping != "nord/sk-tu4-cao":
        # At factory Lenze sends on a change only, STÖBER answers RPDOs, NORD sends every 250 ms.
        more += "\ntpdo = { event_ms = 50 }"
    kind = "guarding" if mapping.startswith("stoeber/") else "heartbeat"
    node = sites.node(
        sites.drive(family.slot[0].name, "modbus", 20_000, more),
        mapping=mapping,
        more=f'supervision = "{kind}"',
    )
    path = sites.write(folder, sites.bus(node), sites.modbus(), name="jogging")
    bench = DeafBench(load_site(path), family=family, mapping=mapping, node=simulate_node(mapping, 5, {}))
    bench.run(2.0)
    (drive,) = bench.plant.drives
    leaf, speed = SPEEDS[mapping]
    bench.start(drive)
    bench.run(1.0)
    assert bench.write(drive, **{leaf: speed}).ok
    bench.run(3.0)
    assert bench.plant.drives[drive].is_enabled
    assert bench.value(f"{drive}/actual/{leaf}")
    return bench, drive


@pytest.mark.landing(2)
@pytest.mark.parametrize("mapping", SPEEDS)
def test_a_drive_that_goes_deaf_while_its_owner_jogs_is_named(tmp_path: Path, mapping: str) -> None:
    bench, drive = running(tmp_path, mapping)
    bench.is_deaf = True
    bench.jog(drive, NAMED_S)
    (event,) = bench.worst
    assert event.source == drive
    assert event.message.startswith("ignores its stop: ")


@pytest.mark.landing(2)
@pytest.mark.parametrize("mapping", SPEEDS)
def test_a_drive_that_hears_is_not_named_while_its_owner_jogs(tmp_path: Path, mapping: str) -> None:
    bench, drive = running(tmp_path, mapping)
    bench.jog(drive, NAMED_S / 6)
    assert not bench.worst
