"""``drivebridge parameters``: what supervises a drive takes ``--force``, said before a bus is opened."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from bridge.cli.app import make_app


@pytest.mark.landing(8)
@pytest.mark.parametrize("name", ["P509", "P513", "P151", "P120", "P515", "P546", "2201:00", "6040:00"])
def test_what_supervises_a_drive_takes_force_on_the_command_line(site: Path, name: str) -> None:
    """Said before a bus is opened."""
    arguments = ["parameters", "write", str(site), "conveyor/fu1", name, "1", "--yes"]
    done = CliRunner().invoke(make_app(), arguments)
    assert done.exit_code == 2
    assert "Nothing was written. --force writes" in " ".join(done.output.replace("│", " ").split())
