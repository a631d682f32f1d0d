"""``drivebridge eds``: the EDS of a family, and what canopen makes of it."""

from __future__ import annotations

from io import StringIO

import canopen
from typer.testing import CliRunner

from bridge.cli.app import make_app

NORD = "nord/sk-tu4-cao"


def imported(text: str, node_id: int = 5) -> canopen.ObjectDictionary:
    file = StringIO(text)
    file.name = "dictionary.eds"
    return canopen.import_od(file, node_id)


def test_the_command_prints_the_eds() -> None:
    result = CliRunner().invoke(make_app("eds"), ["eds", NORD, "--format", "canopen", "--node-id", "5"])
    assert result.exit_code == 0, result.output
    dictionary = imported(result.output)
    assert dictionary["P102"]["P102.1"].unit == "s"


def test_the_format_for_canopen_stands_alone() -> None:
    result = CliRunner().invoke(make_app("eds"), ["eds", NORD, "--format", "canopen", "--json"])
    assert result.exit_code == 2
