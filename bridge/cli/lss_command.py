"""``lss``: node ids and bit rates of devices, told apart by what they are (CiA 305)."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, TypeVar

import typer

from bridge.base.errors import OperationFailed
from bridge.bustools import lss_task
from bridge.bustools.lss_task import LssTask
from bridge.canopen.lss import BIT_RATES, NO_NODE_ID, LssAddress, LssError, Service
from bridge.canopen.lss_scan import Scanned, find_all
from bridge.cli.bus_runner import (
    AsJson,
    BusChoice,
    CliBus,
    carry_out,
    choose_bus,
    print_table,
    takes_bus,
    tell,
)
from bridge.cli.terminal import progress

app = typer.Typer(help="Give devices node ids and bit rates (CiA 305).", no_args_is_help=True)

_T = TypeVar("_T")
_QUESTIONS = 134
"""Number of questions of a fastscan that finds a device."""
_NUMBER = re.compile(r"(?:0x)?([0-9a-f]{1,8})h?", re.IGNORECASE)

Site = Annotated[Path | None, typer.Argument(metavar="[SITE]")]
Timeout = Annotated[int, typer.Option(min=5, max=10_000, help="how long to wait for each answer")]
Which = Annotated[
    str | None,
    typer.Option("--identity", help="the device: VENDOR:PRODUCT:REVISION:SERIAL, hexadecimal"),
]
Only = Annotated[bool, typer.Option("--only", help="it is the only device on the bus")]
Keep = Annotated[bool, typer.Option("--store", help="store it in the device, too")]


@app.command()
@takes_bus
def scan(
    which: BusChoice,
    site: Site = None,
    known: Annotated[
        str | None, typer.Option(help="as for --identity, 0 where unknown: these numbers are not searched")
    ] = None,
    timeout_ms: Annotated[
        int, typer.Option(min=5, max=10_000, help="how long to wait at least for each answer")
    ] = 100,
    as_json: AsJson = False,
) -> None:
    """Find every device that has no node id (fastscan). 14 seconds for each, longer for slow ones."""
    line = choose_bus(site, which)
    scanned = Scanned()
    try:
        _run(line, find_all(parse_identity(known) if known else None, scanned), timeout_ms)
    except OperationFailed as error:
        scanned.problem = f"{error}; what is listed was not checked"
    _print_scanned(scanned, as_json=as_json)
    if scanned.problem:
        raise OperationFailed(f"there may be more devices: {scanned.problem}")


def _print_scanned(scanned: Scanned, *, as_json: bool) -> None:
    for identity in scanned.keeps_answering:
        tell(f"{identity_text(identity)} keeps answering after it was found: the others were told apart")
    if as_json:
        rows = [one._asdict() | {"keeps_answering": one in scanned.keeps_answering} for one in scanned.found]
        print(json.dumps(rows, indent=2))
    elif scanned.found:
        print_table([("vendor", "product", "revision", "serial", "--identity"), *map(_row, scanned.found)])
    elif not scanned.problem:
        print("no device without a node id")


@app.command()
@takes_bus
def inquire(
    which: BusChoice,
    site: Site = None,
    identity: Which = None,
    only: Only = False,
    timeout_ms: Timeout = 500,
    as_json: AsJson = False,
) -> None:
    """Ask a device for its identity and node id."""
    line = choose_bus(site, which)
    found, node_id = _run(line, lss_task.inquire(_which(identity, only)), timeout_ms)
    if as_json:
        print(json.dumps({"node_id": None if node_id == NO_NODE_ID else node_id} | found._asdict()))
        return
    print(f"{identity_text(found)}: {'no node id' if node_id == NO_NODE_ID else f'node id {node_id}'}")


@app.command("set-id")
@takes_bus
def set_id(
    node_id: Annotated[int, typer.Option("--id", min=1, max=255, help="1…127; 255 takes it away")],
    which: BusChoice,
    site: Site = None,
    identity: Which = None,
    only: Only = False,
    keep: Keep = False,
    timeout_ms: Timeout = 500,
    as_json: AsJson = False,
) -> None:
    """Give a device a node id. One that has another already takes it with its next reset."""
    if 127 < node_id < NO_NODE_ID:
        raise typer.BadParameter(f"{node_id} is no node id: 1…127, or 255 for none")
    line = choose_bus(site, which)
    _run(line, lss_task.set_node_id(_which(identity, only), node_id, keep=keep), timeout_ms)
    _report({"ok": True, "node_id": node_id, "stored": keep}, f"node id {node_id}", keep, as_json)


@app.command("set-bitrate")
@takes_bus
def set_bitrate(
    new: Annotated[str, typer.Option(help="bit/s, or auto")],
    which: BusChoice,
    site: Site = None,
    identity: Which = None,
    only: Only = False,
    keep: Keep = False,
    activate_ms: Annotated[
        int | None, typer.Option(min=1, max=65_535, help="switch now, with this silence before and after")
    ] = None,
    timeout_ms: Timeout = 500,
    as_json: AsJson = False,
) -> None:
    """Give a device a bit rate. Without --activate-ms it counts from the device's next start."""
    rates = [rate for rate in BIT_RATES if rate]
    rate = None if new == "auto" else int(new) if new.isdecimal() else 0
    if rate is not None and rate not in rates:
        raise typer.BadParameter(f"{new!r} is no bit rate of LSS: {', '.join(map(str, rates))} or auto")
    line = choose_bus(site, which)
    service = lss_task.set_bit_rate(_which(identity, only), rate, keep=keep, activate_ms=activate_ms)
    _run(line, service, timeout_ms)
    facts = {"ok": True, "bitrate": rate, "stored": keep, "active": activate_ms is not None}
    _report(facts, f"{new} bit/s" if rate else "automatic bit rate", keep, as_json)


@app.command()
@takes_bus
def store(
    which: BusChoice,
    site: Site = None,
    identity: Which = None,
    only: Only = False,
    timeout_ms: Timeout = 2000,
    as_json: AsJson = False,
) -> None:
    """Make a device store its node id and bit rate."""
    line = choose_bus(site, which)
    _run(line, lss_task.keep_settings(_which(identity, only)), timeout_ms)
    _report({"ok": True, "stored": True}, "node id and bit rate", True, as_json)


def parse_identity(text: str) -> LssAddress:
    """The four numbers of object 1018h, in hexadecimal with colons between them."""
    matches = [_NUMBER.fullmatch(part) for part in text.split(":")]
    if len(matches) != 4 or not all(matches):
        raise typer.BadParameter(f"{text!r} is no identity: VENDOR:PRODUCT:REVISION:SERIAL in hexadecimal")
    return LssAddress(*(int(match[1], 16) for match in matches if match))


def identity_text(identity: LssAddress) -> str:
    """Identity as ``--identity`` takes it."""
    return ":".join(f"{number:08X}" for number in identity)


def _row(identity: LssAddress) -> tuple[str, ...]:
    return (*(f"{number:08X}h" for number in identity), identity_text(identity))


def _which(identity: str | None, only: bool) -> LssAddress | None:
    """None: the only device on the bus. Raises BadParameter unless exactly one of the two is given."""
    if only == (identity is not None):
        raise typer.BadParameter("which device? Give --identity, or --only where there is no other")
    return parse_identity(identity) if identity else None


def _report(facts: Mapping[str, object], what: str, keep: bool, as_json: bool) -> None:
    print(json.dumps(facts) if as_json else f"{what} {'stored' if keep else 'set, not stored'}")


def _run(line: CliBus, service: Service[_T], timeout_ms: int) -> _T:
    """Carry it out, with the present step on a terminal. Raises ``OperationFailed``."""

    def make(now: float) -> LssTask[_T]:
        return LssTask(service, now, timeout_ms / 1000)

    with progress("LSS") as show:
        task = carry_out(line, make, lambda e: show(e.steps % _QUESTIONS, _QUESTIONS, e.step))
    if task.late:
        tell(f"warning: answers came too late ({task.late}): --timeout-ms gives more time")
    try:
        return task.result
    except LssError as error:
        raise OperationFailed(str(error)) from None
