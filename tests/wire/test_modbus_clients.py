"""Every maximal run of every family's export, read by three clients that we did not write."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import pytest
from pymodbus.client import ModbusTcpClient

from bridge.image import Quality
from bridge.northbound.modbus.registers import MIRROR, RegisterTable
from bridge.northbound.modbus.units import drive_maps, units_of
from bridge.sim.catalogue import SIMULATED
from tests.support.families import FamilyBridge, family_bridge
from tests.support.modbus_runs import Run, runs_of
from tests.support.process import REPOSITORY, until

HOST: Final = "127.0.0.1"
NODE: Final = REPOSITORY / "tests" / "wire" / "node"


@dataclass(frozen=True)
class Asked:
    """A run of one unit; ``has_values``: at least one of its rows is there."""

    unit: int
    function: int
    start: int
    count: int
    has_values: bool = True


Found = Sequence[int] | str
"""What was read, or the client's error."""


@pytest.fixture(scope="module")
def bridge(tmp_path_factory: pytest.TempPathFactory) -> Iterator[FamilyBridge]:
    with family_bridge(tmp_path_factory.mktemp("runs"), SIMULATED, "modbus") as bridge:
        yield bridge


@pytest.fixture(scope="module")
def asked(bridge: FamilyBridge) -> list[Asked]:
    until(lambda: not bridge.call(lambda: _unread(bridge)), 40.0, "every parameter was read once")
    return bridge.call(lambda: list(_runs(bridge)))


def _unread(bridge: FamilyBridge) -> list[str]:
    """Points that have no value yet and no reason why."""
    image = bridge.service.plant.image
    states = ((name, image.read(name)) for name in image.index)
    return [name for name, state in states if state.quality is Quality.WAITING and not state.reason]


def _runs(bridge: FamilyBridge) -> Iterator[Asked]:
    plant = bridge.service.plant
    index, image = plant.image.index, plant.image
    for drive_map in drive_maps(plant.catalogue):
        for run in runs_of(drive_map.rows):
            names = [f"{drive_map.drive_name}/{row.name}" for row in run.rows]
            there = [name not in index or image.read(name).quality.has_value for name in names]
            yield _asked(drive_map.unit_id, run, has_values=any(there))
            if run.table is RegisterTable.INPUT_REGISTER:
                yield Asked(drive_map.unit_id, 3, MIRROR + run.start, run.count, any(there))
    for run in runs_of(units_of(plant.catalogue).bridge_rows):
        yield _asked(255, run, has_values=True)


def _asked(unit: int, run: Run, *, has_values: bool) -> Asked:
    return Asked(unit, run.function, run.start, run.count, has_values)


def pymodbus(port: int, asked: Sequence[Asked]) -> list[Found]:
    found: list[Found] = []
    with ModbusTcpClient(HOST, port=port, timeout=5) as client:
        reads = {
            1: client.read_coils,
            2: client.read_discrete_inputs,
            3: client.read_holding_registers,
            4: client.read_input_registers,
        }
        for one in asked:
            answer = reads[one.function](one.start, count=one.count, device_id=one.unit)
            if answer.isError():
                found.append(str(answer))
            else:
                found.append(answer.registers or answer.bits[: one.count])
    return found


def modbus_serial(port: int, asked: Sequence[Asked]) -> list[Found]:
    runs = json.dumps([[one.unit, one.function, one.start, one.count] for one in asked])
    done = subprocess.run(
        ["node", "modbus.mjs", str(port)],
        cwd=NODE,
        input=runs,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    # It unpacks whole bytes.
    return [
        one if isinstance(one, str) else one[: of.count]
        for one, of in zip(json.loads(done.stdout), asked, strict=True)
    ]


def mbpoll(port: int, asked: Sequence[Asked]) -> list[Found]:
    program = shutil.which("mbpoll", path="/usr/bin:/usr/local/bin")
    if program is None:
        pytest.fail("mbpoll is missing: apt-get install mbpoll", pytrace=False)
    tables = {1: "0", 2: "1", 4: "3", 3: "4"}
    found: list[Found] = []
    for one in asked:
        place = ["-a", str(one.unit), "-t", tables[one.function], "-r", str(one.start), "-c", str(one.count)]
        done = subprocess.run(
            [program, "-m", "tcp", "-p", str(port), "-0", "-1", "-o", "5", *place, HOST],
            capture_output=True,
            text=True,
            timeout=20,
            check=False,
        )
        values = [int(value) for value in re.findall(r"^\[\d+\]:\s+(\d+)", done.stdout, re.MULTILINE)]
        found.append(values if done.returncode == 0 else done.stdout + done.stderr)
    return found


@pytest.mark.landing
@pytest.mark.parametrize("client", [pymodbus, modbus_serial, mbpoll])
def test_every_maximal_run_is_read(
    bridge: FamilyBridge, asked: list[Asked], client: Callable[[int, Sequence[Asked]], list[Found]]
) -> None:
    found = client(bridge.site.port, asked)
    for one, values in zip(asked, found, strict=True):
        is_read = not isinstance(values, str)
        assert is_read == one.has_values, f"{one}: {values}"
        assert not is_read or len(values) == one.count, one
    assert sum(one.has_values for one in asked) > 5 * len(SIMULATED)
