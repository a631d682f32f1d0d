"""The command line: one file per group of commands, errors turned into exit codes here."""

from __future__ import annotations

import sys

import typer

from bridge import __version__
from bridge.cli import (
    audit,
    drop_test,
    eds,
    export,
    lss,
    monitor,
    nmt,
    parameter_sets,
    parameters,
    project,
    scan,
    sdo,
    serve,
)
from bridge.cli.terminal import printable_lines
from bridge.errors import BridgeError

app = typer.Typer(
    name="drivebridge",
    help="CANopen master for industrial drives, served as OPC UA, Modbus TCP and zenoh.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
app.command()(serve.demo)
app.command()(serve.run)
app.command()(serve.simulate)
app.command(hidden=True)(serve.demo_controller)
app.command()(project.check)
app.command()(audit.audit)
app.command("drop-test")(drop_test.drop_test)
app.command()(eds.eds)
app.command("hash-password")(project.hash_password)
app.command()(scan.scan)
app.command()(nmt.nmt)
app.command()(monitor.monitor)
app.add_typer(sdo.app, name="sdo")
app.add_typer(parameters.app, name="parameters")
for command in (parameter_sets.backup, parameter_sets.compare, parameter_sets.restore):
    parameters.app.command()(command)
app.add_typer(lss.app, name="lss")
app.add_typer(export.app, name="export")


@app.command()
def version() -> None:
    """Print the version."""
    print(__version__)


def run_app() -> None:
    """Run the command line. Exit codes: 0 done, 1 failed, 2 bad usage or file, 3 bus or port."""
    try:
        app()
    except BridgeError as error:
        # Empty where a child has told it already.
        if sentence := str(error):
            print(printable_lines(sentence), file=sys.stderr)
        raise SystemExit(error.exit_code) from None
