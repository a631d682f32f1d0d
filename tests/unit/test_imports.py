"""A command imports what it needs: where the OPC UA front has ended, its clients wait for the next one."""

from __future__ import annotations

import subprocess
import sys

import pytest
import typer.main
from typer.core import TyperGroup

from bridge.cli.app import make_app

_OTHERS = (
    "bridge.service",
    "bridge.sim",
    "bridge.master",
    "bridge.node",
    "bridge.errands",
    "bridge.lint",
    "bridge.eds",
    "bridge.dbc",
)


@pytest.mark.parametrize(("word", "imported"), [("version", ""), ("run", "import bridge.front; ")])
def test_a_command_does_not_import_the_others(word: str, imported: str) -> None:
    script = (
        f"import sys; from bridge.cli.app import make_app; make_app({word!r}); {imported}print(*sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert [name for name in done.stdout.split() if name.startswith(_OTHERS)] == []


def commands(word: str = "") -> set[str]:
    group = typer.main.get_command(make_app(word))
    assert isinstance(group, TyperGroup)
    return set(group.commands)


def test_where_no_command_is_named_there_are_all() -> None:
    assert {"demo", "run", "version", "sdo", "parameters"} <= commands()
    assert commands("chekc") == commands()
    assert commands("sdo") == {"sdo"}
