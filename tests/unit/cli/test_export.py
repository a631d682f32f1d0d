"""``drivebridge export``: a row for each of what is served, as CSV and JSON; a bus that has to be named."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from bridge.cli.app import make_app
from tests.support import sites


def export(folder: Path, *arguments: str, buses: int = 1) -> Result:
    nodes = [
        sites.bus(sites.node(sites.drive("fu1", "zenoh", 200, ""), name=f"n{number}"), name=f"can{number}")
        for number in range(buses)
    ]
    path = sites.write(folder, *nodes, sites.zenoh(), sites.modbus(), sites.opcua())
    what, *more = arguments
    return CliRunner().invoke(make_app(), ["export", what, str(path), *more])


@pytest.mark.parametrize(("what", "first"), [("modbus", "unit_id"), ("opcua", "node_id"), ("zenoh", "key")])
def test_a_table_is_the_same_for_people_and_machines(tmp_path: Path, what: str, first: str) -> None:
    rows = list(csv.DictReader(io.StringIO(export(tmp_path, what).stdout)))
    told = json.loads(export(tmp_path, what, "--json").stdout)
    assert next(iter(rows[0])) == next(iter(told[0])) == first
    assert len(rows) == len(told) > 50
    for row, fact in zip(rows, told, strict=True):
        assert row == {name: "" if value is None else str(value) for name, value in fact.items()}


def test_of_several_buses_a_dbc_file_is_of_one(tmp_path: Path) -> None:
    done = export(tmp_path, "dbc", buses=2)
    assert done.exit_code == 2
    assert "the site has the buses can0, can1" in " ".join(done.output.replace("│", " ").split())
    done = export(tmp_path, "dbc", "--bus", "can7", buses=2)
    assert done.exit_code == 2
    done = export(tmp_path, "dbc", "--bus", "can1", buses=2)
    assert done.exit_code == 0
    assert " n1_heartbeat" in done.stdout
    assert " n0_heartbeat" not in done.stdout
