"""The command line: one file per group of commands, errors turned into exit codes here."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable
from typing import Final

import typer

from bridge import __version__
from bridge.base.errors import BridgeError
from bridge.cli.terminal import printable_lines

_COMMANDS: Final = {
    "demo": "serve.demo",
    "run": "serve.run",
    "simulate": "serve.simulate",
    "demo-controller": "serve.demo_controller",
    "check": "project_command.check",
    "audit": "audit_command.audit",
    "drop-test": "drop_test_command.drop_test",
    "exchange": "exchange.exchange",
    "conformance": "conformance_command.conformance",
    "witness": "witness.witness",
    "eds": "eds_command.eds",
    "family": "family_command.app",
    "faults": "faults_command.faults",
    "certificates": "certificates_command.app",
    "hash-password": "project_command.hash_password",
    "record": "record_command.record",
    "replay": "replay_command.replay",
    "scan": "scan_command.scan",
    "nmt": "nmt_command.nmt",
    "monitor": "monitor.monitor",
    "version": "app.version",
    "sdo": "sdo_command.app",
    "parameters": "parameters_command.app",
    "lss": "lss_command.app",
    "export": "export.app",
}
"""Function in ``bridge.cli`` of each command, or group of commands."""
_HIDDEN: Final = ("demo-controller",)


def make_app(word: str = "") -> typer.Typer:
    """The command line. If ``word`` is a command, only that one: importing the libraries of all commands
    takes longer than most of them run."""
    app = typer.Typer(
        name="drivebridge",
        help="CANopen master for industrial drives, served as OPC UA, Modbus TCP and zenoh.",
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
    )
    # Without it a single command would have no name.
    app.callback()(lambda: None)
    for name in [word] if word in _COMMANDS else _COMMANDS:
        module, _, what = _COMMANDS[name].partition(".")
        command = getattr(importlib.import_module(f"bridge.cli.{module}"), what)
        if isinstance(command, typer.Typer):
            app.add_typer(command, name=name)
        else:
            app.command(name, hidden=name in _HIDDEN)(command)
    return app


def version() -> None:
    """Print the version."""
    print(__version__)


def run_app(imported: Callable[[], None] = lambda: None) -> None:
    """Run the command line; ``imported`` is called before anything is done. Exit codes: 0 done, 1 failed,
    2 bad usage or file, 3 bus or port."""
    try:
        app = make_app(*sys.argv[1:2])
        imported()
        app()
    except BridgeError as error:
        # Empty if a child process has already said it.
        if sentence := str(error):
            print(printable_lines(sentence), file=sys.stderr)
        raise SystemExit(error.exit_code) from None
