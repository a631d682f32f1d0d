"""The page shows and checks the limits that a drive's own parameters give, not those of the site file."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.command import Code
from bridge.config import load_site
from bridge.drive import DriveState
from bridge.image import Quality
from bridge.mapping import load_family
from bridge.northbound.page.site_description import described
from bridge.sim.catalogue import simulate_node
from tests.support import sites
from tests.support.bench import Bench

CASES = [
    # BU 2500 §6.5.4: 4000h is P105
    ("nord/sk-tu4-cao", "P105", "frequency", 50.0, 70.0),
    ("lenze/8400-motec", "C00011", "velocity", 1500.0, 2000.0),
]


@pytest.mark.parametrize(("mapping", "parameter", "leaf", "given", "held"), CASES)
def test_a_setpoint_is_limited_as_the_drive_scales_it(
    tmp_path: Path, mapping: str, parameter: str, leaf: str, given: float, held: float
) -> None:
    family = load_family(mapping)
    table = sites.drive(family.slot[0].name, "modbus", 1000, f'parameters = {{ "{parameter}" = {given} }}')
    whole = sites.node(table, name="n", mapping=mapping)
    site = load_site(sites.write(tmp_path, sites.bus(whole), sites.modbus()))
    node = simulate_node(mapping, 5, {parameter: held})
    bench = Bench(site, family=family, mapping=mapping, node=node)
    bench.run(3.0)
    (drive,) = bench.plant.drives
    told = described(bench.plant.image, bench.plant.catalogue)
    nature = told["natures"][told["places"][drive]][f"command/{leaf}"]
    full = f"{drive}/{nature['scaled_by'][0]}"
    place = next(at for at, point in enumerate(bench.plant.image.points) if point.name == full)
    assert bench.plant.image[place].quality is Quality.GOOD
    assert bench.value(full) == held
    low, high = (limit * held for limit in nature["of_full"])
    for value in (low, high):
        assert bench.write(drive, **{leaf: value}).ok, value
    for value in (low - held / 1000, high + held / 1000):
        assert bench.write(drive, **{leaf: value}).code is Code.OUT_OF_RANGE
    assert high > nature.get("high", 0), "the site file's is smaller"
    assert bench.number(f"{drive}/status/state") != DriveState.OPERATION_ENABLED
