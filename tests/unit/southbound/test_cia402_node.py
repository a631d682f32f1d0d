"""The bridge and a CiA 402 drive on a virtual clock, mode by mode."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.command import Action, Code, Outcome, Request
from bridge.config import load_site
from bridge.drive import DriveState
from bridge.image import Quality
from bridge.mapping import load_family
from bridge.sim.cia402_drive import Cia402Drive
from bridge.sim.cia402_settings import Cia402Settings, Mode
from bridge.sim.cia402_states import State
from tests.support.bench import PLC, Bench

DRIVE = "axis/drive"
SITE = """
[site]
name = "bench"
[[bus]]
name = "can0"
interface = "virtual"
[[bus.node]]
name = "axis"
id = 5
mapping = "{mapping}"
{node}
[[bus.node.drive]]
slot = "drive"
control = "modbus"
fieldbus_timeout_ms = 500
{drive}
[modbus]
"""
SUPERVISED = """
configure = [
  { object = "1016:01", type = "uint32", value = 0x7F012C },
  { object = "6007:00", type = "int16", value = 3 },
]
"""
SHUTDOWN, RUN, RESET = 0x0006, 0x000F, 0x0080


@pytest.fixture
def booted(tmp_path: Path):
    def boot(mode: str, node: str = "", drive: str = "", **settings) -> Bench:
        mapping = f"cia402/{mode}"
        path = tmp_path / "site.toml"
        path.write_text(SITE.format(mapping=mapping, node=node, drive=drive), encoding="utf-8")
        simulated = Cia402Drive(5, Cia402Settings(**settings))
        bench = Bench(load_site(path), family=load_family(mapping), mapping=mapping, node=simulated)
        bench.run(2.0)
        return bench

    return boot


def boot_status(bench: Bench) -> str:
    return str(bench.value("axis/node/boot_status"))


def state(bench: Bench) -> DriveState:
    return bench.plant.drives[DRIVE].channel.state


def start(bench: Bench) -> None:
    outcomes: list[Outcome] = []
    bench.plant.submit(Request(PLC, DRIVE, Action.START), bench.now, outcomes.append)
    bench.run(0.2)
    assert [outcome.code for outcome in outcomes] == [Code.OK]
    assert state(bench) is DriveState.OPERATION_ENABLED


def keep(bench: Bench, seconds: float, **values: float) -> None:
    """Write these every 50 ms, as a controller does."""
    for _ in range(round(seconds / 0.05)):
        assert bench.write(DRIVE, **values).code is Code.OK
        bench.run(0.05)


def keep_alive(bench: Bench, seconds: float) -> None:
    for _ in range(round(seconds / 0.05)):
        bench.ask(Action.KEEP_ALIVE, DRIVE)
        bench.run(0.05)


# boot-up


@pytest.mark.parametrize(
    ("mode", "number", "rpdo", "tpdo"),
    [
        ("velocity", 2, "6040:00/16 6042:00/16", "6041:00/16 6044:00/16 6061:00/8"),
        ("profile-velocity", 3, "6040:00/16 60FF:00/32", "6041:00/16 606C:00/32 6061:00/8"),
        ("profile-position", 1, "6040:00/16 607A:00/32", "6041:00/16 6064:00/32 6061:00/8"),
        ("homing", 6, "6040:00/16", "6041:00/16 6064:00/32 6061:00/8"),
        ("cyclic-position", 8, "6040:00/16 607A:00/32", "6041:00/16 6064:00/32 6061:00/8"),
        ("cyclic-velocity", 9, "6040:00/16 60FF:00/32", "6041:00/16 606C:00/32 6061:00/8"),
    ],
)
def test_the_boot_up_writes_mode_and_mapping(booted, mode: str, number: int, rpdo: str, tpdo: str) -> None:
    bench = booted(mode)
    assert boot_status(bench).startswith("ok"), boot_status(bench)
    communication = bench.node.slave._store.current
    for pdo, expected in ((communication.rpdo[0], rpdo), (communication.tpdo[0], tpdo)):
        mapped = " ".join(f"{word >> 16:04X}:{word >> 8 & 0xFF:02X}/{word & 0xFF}" for word in pdo.mapping)
        assert mapped == expected
        assert pdo.transmission_type == (1 if mode.startswith("cyclic") else 255)
    assert bench.node.settings.mode == number
    assert bench.value("axis/drive/actual/mode") == number
    assert state(bench) is DriveState.SWITCH_ON_INHIBITED
    assert bench.plant.drives[DRIVE].quality is Quality.GOOD


def test_a_second_boot_up_writes_nothing(booted) -> None:
    bench = booted("profile-velocity")
    bench.log.clear()
    bench.ask(Action.BOOT, "axis") if hasattr(Action, "BOOT") else bench.node.slave.boot()
    bench.run(2.0)
    writes = [frame.data.hex() for frame in bench.sent(0x605) if frame.data[0] >> 5 == 1]
    assert writes == []
    assert boot_status(bench).startswith("ok")
