"""The table of fronts: whatever the bus process starts and ``run --role`` runs stands in it once."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from bridge.base.errors import OperationFailed, Unavailable
from bridge.config import Site, load_site
from bridge.service.fronts import FRONTS, FrontKind, ProcessRole
from tests.support import sites


def site(folder: Path, *tables: str) -> tuple[Site, Path]:
    path = sites.write(folder, sites.bus(sites.node(sites.drive("fu1", "none", 0))), *tables)
    return load_site(path), path


def test_each_role_of_a_process_but_the_bus_has_one_front() -> None:
    assert [kind.role for kind in FRONTS] == [
        role for role in ProcessRole if role not in (ProcessRole.ALL, ProcessRole.BUS)
    ]


@pytest.mark.parametrize("kind", FRONTS, ids=lambda kind: kind.role)
def test_a_site_has_the_fronts_of_its_tables(kind: FrontKind[Any], tmp_path: Path) -> None:
    with_it, without = site(tmp_path, f"[{kind.role}]"), site(tmp_path, "[modbus]")
    assert kind.settings(with_it[0]) is not None
    assert kind.settings(without[0]) is None
    kind.check_files(*without)


@pytest.mark.parametrize("kind", FRONTS, ids=lambda kind: kind.role)
def test_a_front_that_the_site_does_not_have_cannot_be_run(kind: FrontKind[Any], tmp_path: Path) -> None:
    _, path = site(tmp_path)
    with pytest.raises(OperationFailed, match=rf"the site file has no \[{kind.role}\] table"):
        kind.run()(path, None, None).close()


def test_what_a_front_needs_of_the_disk_is_checked(tmp_path: Path) -> None:
    missing = tmp_path / "missing"
    with_users = site(tmp_path, f'[zenoh]\nuser = "bridge"\npassword_file = "{missing}"')
    [zenoh] = [kind for kind in FRONTS if kind.role == ProcessRole.ZENOH]
    with pytest.raises(Unavailable, match=str(missing)):
        zenoh.check_files(*with_users)


def test_the_table_loads_none_of_what_fronts_are_made_of() -> None:
    script = "import sys; import bridge.service.fronts; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    assert not {"asyncua", "zenoh", "cryptography", "bridge.project"} & set(loaded.split())
