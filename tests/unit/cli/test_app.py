"""A command imports what it needs: where the OPC UA front has ended, its clients wait for the next one."""

from __future__ import annotations

import subprocess
import sys

import pytest
import typer.main
from typer.core import TyperGroup

from bridge.cli.app import make_app
from tests.support.process import REPOSITORY

DEMO_SITE = REPOSITORY / "bridge" / "demo" / "site.toml"
_OTHERS = (
    "bridge.service.bus_process",
    "bridge.sim",
    "bridge.master",
    "bridge.node",
    "bridge.bustools",
    "bridge.lint",
    "bridge.eds",
    "bridge.dbc",
    "bridge.dictionary",
)


@pytest.mark.landing(2)
@pytest.mark.parametrize(
    ("word", "imported"), [("version", ""), ("run", "import bridge.service.opcua_front; ")]
)
def test_a_command_does_not_import_the_others(word: str, imported: str) -> None:
    script = (
        f"import sys; from bridge.cli.app import make_app; make_app({word!r}); {imported}print(*sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert [name for name in done.stdout.split() if name.startswith(_OTHERS)] == []


@pytest.mark.landing
def test_without_cantools_a_dbc_export_says_what_to_install() -> None:
    script = (
        "import sys; sys.modules['cantools'] = None; "
        f"sys.argv = ['drivebridge', 'export', 'dbc', {str(DEMO_SITE)!r}]; "
        "from bridge.cli.app import run_app; run_app()"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.startswith("writing a DBC file needs cantools")
    assert f"`{sys.executable} -m pip install cantools`" in done.stderr


def test_without_canopen_its_object_dictionary_says_what_to_install() -> None:
    script = (
        "import sys; sys.modules['canopen'] = None; "
        "sys.argv = ['drivebridge', 'eds', 'nord/sk-tu4-cao', '--format', 'canopen']; "
        "from bridge.cli.app import run_app; run_app()"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (1, "")
    assert f"`{sys.executable} -m pip install canopen`" in done.stderr


def commands(word: str = "") -> set[str]:
    group = typer.main.get_command(make_app(word))
    assert isinstance(group, TyperGroup)
    return set(group.commands)


def test_where_no_command_is_named_there_are_all() -> None:
    assert {"demo", "run", "version", "sdo", "parameters"} <= commands()
    assert commands("chekc") == commands()
    assert commands("sdo") == {"sdo"}
