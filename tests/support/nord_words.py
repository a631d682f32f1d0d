"""A NORD node whose words mean what a test wants: P543 and P546 in every parameter set (BU 2500 §6.5.4)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from bridge.command import Code
from bridge.config import load_site
from bridge.image import Reading
from bridge.mapping import load_family
from bridge.sim.nord.nord_drive import NordDrive
from bridge.sim.nord.nord_single import NordSingle
from bridge.sim.nord.nord_single_settings import TU3
from bridge.sim.nord.nord_tu4 import NordTu4
from tests.support.bench import Bench

SITE = """
[site]
name = "bench"
[[bus]]
name = "can0"
interface = "virtual"
[[bus.node]]
name = "lift"
id = 5
mapping = "{mapping}"
[[bus.node.drive]]
slot = "{slot}"
name = "drive"
control = "modbus"
fieldbus_timeout_ms = 0
parameters = {{ P112 = 10.0, "P112.2" = 10.0 }}
[modbus]
"""
DRIVE = "lift/drive"
SHUT_DOWN, ENABLE = 0x047E, 0x047F
SET_2 = 0x4000
P105, ACTUAL, SETPOINT = 105, 543, 546


def inverter(bench: Bench) -> NordDrive:
    node: Any = bench.node
    return node.drives[0] if isinstance(node, NordTu4) else node.drive


def means(drive: NordDrive, number: int, *codes: int, in_set: int | None = None) -> None:
    """P543 or P546 of these words: elements of an SK TU4-CAO's drive."""
    for parameter_set in range(1, 5) if in_set is None else (in_set,):
        for element, code in enumerate(codes, 1):
            drive.parameters.at_keypad(number, code, element=element, parameter_set=parameter_set)


def made(folder: Path, mapping: str = "nord/sk-tu4-cao", prepare: Any = None) -> Bench:
    node: Any = NordTu4(5) if "tu4" in mapping else NordSingle(5, TU3)
    slot = "fu1" if "tu4" in mapping else "drive"
    path = folder / "site.toml"
    path.write_text(SITE.format(mapping=mapping, slot=slot), encoding="utf-8")
    bench = Bench(load_site(path), family=load_family(mapping), mapping=mapping, node=node)
    if prepare:
        power_on = inverter(bench).power_on

        def powered(now: float) -> None:
            power_on(now)
            prepare(inverter(bench))

        inverter(bench).power_on = powered  # type: ignore[method-assign]
        prepare(inverter(bench))
    bench.run(3.0)
    return bench


def point(bench: Bench, leaf: str) -> Reading:
    return bench.plant.image.read(f"{DRIVE}/{leaf}")


def enable(bench: Bench, bits: int = 0, **setpoints: float) -> None:
    assert bench.write(DRIVE, control_word=SHUT_DOWN | bits).code is Code.OK
    bench.run(0.3)
    outcome = bench.write(DRIVE, control_word=ENABLE | bits, **setpoints)
    assert outcome.code is Code.OK, outcome
    bench.run(3.0)
