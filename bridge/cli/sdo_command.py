"""``sdo read`` and ``sdo write``: one object of one node."""

from __future__ import annotations

import json
import re
import sys
from dataclasses import dataclass
from typing import Annotated, Literal

import typer

from bridge.base.errors import OperationFailed
from bridge.bustools.single import SdoTask
from bridge.canopen import datatypes, width
from bridge.canopen.datatypes import INTEGERS, NUMBERS, REALS, Plain, TypeName
from bridge.canopen.decode_sdo import shown
from bridge.canopen.sdo import SdoError
from bridge.cli.bus_runner import (
    AsJson,
    BusChoice,
    CliBus,
    carry_out,
    choose_bus,
    split_site,
    takes_bus,
    tell,
)
from bridge.cli.known_servers import KnownServers
from bridge.cli.terminal import printable, progress
from bridge.mapping.model import SdoServer
from bridge.parameter import Names, ObjectRef
from bridge.parameter.number_text import NumberError, command_line_number
from bridge.text import Text

app = typer.Typer(help="Read or write an object of a node.", no_args_is_help=True)

_OBJECT = re.compile(r"(?:0x)?([0-9a-f]{1,4})h?(?::(?:0x)?([0-9a-f]{1,2})h?)?", re.IGNORECASE)
_READ_USAGE = "drivebridge sdo read [SITE] NODE INDEX[:SUB]"
_WRITE_USAGE = "drivebridge sdo write [SITE] NODE INDEX[:SUB] VALUE --type TYPE"


ValueType = Literal[TypeName, "float", "double"]
_ALSO = {"float": "real32", "double": "real64"}
"""Names that points and other tools have for real numbers."""
Timeout = Annotated[
    int | None, typer.Option(min=10, max=60_000, help="how long to wait for each answer; 500, or the site's")
]
Retries = Annotated[
    int | None, typer.Option(min=0, max=10, help="how often to ask again after silence; 0, or the site's")
]
Server = Annotated[
    int, typer.Option("--sdo-channel", min=1, max=128, help="one of the mapping's further SDO channels")
]


@app.command()
@takes_bus
def read(
    what: Annotated[list[str], typer.Argument(metavar="[SITE] NODE INDEX[:SUB]")],
    which: BusChoice,
    kind: Annotated[ValueType | None, typer.Option("--type", help="how to take the bytes")] = None,
    timeout_ms: Timeout = None,
    retries: Retries = None,
    sdo_channel: Server = 1,
    as_json: AsJson = False,
) -> None:
    """Read an object. INDEX and SUB are hexadecimal; SUB is 0 where it is left out."""
    site, (node, name) = split_site(what, 2, _READ_USAGE)
    line = choose_bus(site, which)
    index, sub = parse_object(name)
    target = _sdo_target(line, line.node_id(node), sdo_channel, timeout_ms, retries)
    data = _transfer(line, target, index, sub, None, as_json=as_json)
    try:
        value = None if kind is None else decode(kind, data)
    except ValueError as error:
        raise OperationFailed(f"{index:04X}h:{sub:02X}: {error}") from None
    if kind is not None and (said := surplus(kind, data)):
        tell(f"warning: {index:04X}h:{sub:02X}: {said}")
    if as_json:
        facts = {"node": line.node_id(node), "index": f"{index:04X}", "sub": sub, "data": data.hex()}
        print(json.dumps({"ok": True} | facts | {"type": kind, "value": value}))
        return
    print(for_people(value, data))


@app.command(context_settings={"ignore_unknown_options": True})
@takes_bus
def write(
    what: Annotated[list[str], typer.Argument(metavar="[SITE] NODE INDEX[:SUB] VALUE")],
    kind: Annotated[ValueType, typer.Option("--type", help="how to send the value")],
    which: BusChoice,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="do not ask")] = False,
    force: Annotated[
        bool, typer.Option("--force", help="also what commands, supervises or addresses the drive")
    ] = False,
    timeout_ms: Timeout = None,
    retries: Retries = None,
    sdo_channel: Server = 1,
    as_json: AsJson = False,
) -> None:
    """Write an object. On a terminal it asks first: a drive may move, and many keep it in EEPROM."""
    site, (node, name, text) = split_site(what, 3, _WRITE_USAGE)
    line = choose_bus(site, which)
    index, sub = parse_object(name)
    node_id = line.node_id(node)
    try:
        data = encode(kind, text)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None
    why = None if force else why_forced(line, node_id, ObjectRef(index, sub))
    if why:
        raise typer.BadParameter(f"{why}. --force writes it: not beside a bridge whose drive runs")
    target = _sdo_target(line, node_id, sdo_channel, timeout_ms, retries)
    where = f"{index:04X}h:{sub:02X} of node {node_id}"
    question = f"write {decode(kind, data)} ({kind}) to {where}?"
    if not yes and sys.stdin.isatty() and not typer.confirm(question, err=True):
        raise OperationFailed("nothing written")
    _transfer(line, target, index, sub, data, as_json=as_json)
    if as_json:
        facts = {"node": node_id, "index": f"{index:04X}", "sub": sub, "data": data.hex()}
        print(json.dumps({"ok": True} | facts))
        return
    print(f"{where} written: {text}")


def why_forced(line: CliBus, node_id: int, address: ObjectRef) -> Text | None:
    """Reason why this object of a node is written with ``--force`` only. Without a site there is no bridge
    that supervises the node."""
    node = next((node for node in line.table.node if node.id == node_id), None)
    if node is None:
        return None
    names = Names(line.families[node.mapping_key])
    return names.protection.why_forced(names.resolve(str(address)))


def parse_object(text: str) -> tuple[int, int]:
    """Index and sub-index of ``1018:01``, ``1018h`` or ``0x1018:1``."""
    match = _OBJECT.fullmatch(text)
    if not match:
        raise typer.BadParameter(f"{text!r} is no object: INDEX[:SUB] in hexadecimal, such as 1018:01")
    return int(match[1], 16), int(match[2] or "0", 16)


def encode(kind: ValueType, text: str) -> bytes:
    """The bytes of a value. Raises ValueError with a sentence for the user."""
    name = _ALSO.get(kind, kind)
    try:
        return datatypes.encode(name, _typed(name, text))
    except NumberError as error:
        raise ValueError(f"{error} ({kind})") from None
    except (ValueError, KeyError):
        raise ValueError(f"{text!r} is no {kind} value") from None


def _typed(name: str, text: str) -> Plain:
    if name == "bool":
        return {"0": False, "1": True, "false": False, "true": True}[text.lower()]
    if name in REALS:
        return float(command_line_number(text, is_code=False))
    return command_line_number(text) if name in INTEGERS else text


def decode(kind: ValueType, data: bytes) -> Plain:
    """The value of these bytes; those beyond the type do not count. Raises ValueError where some are
    missing."""
    name = _ALSO.get(kind, kind)
    size = NUMBERS[name].size if name in NUMBERS else len(data)
    if len(data) < size:
        raise ValueError(f"{kind} has {size} bytes, the node sent {len(data)}: {data.hex(' ').upper()}")
    return datatypes.decode(name, data)


def surplus(kind: ValueType, data: bytes) -> str:
    """Remark about bytes beyond the type that are not its padding; empty where there are none."""
    name = _ALSO.get(kind, kind)
    if name not in NUMBERS:
        return ""
    size = NUMBERS[name].size
    if not width.surplus(data, size, signed=name in INTEGERS and INTEGERS[name].signed):
        return ""
    return f"{kind} has {size} bytes, the node sent {len(data)}: {data.hex(' ').upper()}"


def for_people(value: int | float | str | bool | None, data: bytes) -> str:
    """A value on the terminal; without a type, everything its bytes may mean."""
    return printable(shown(data) if value is None else str(value))


@dataclass(frozen=True, slots=True)
class _SdoTarget:
    """SDO server of a node, with its time-out."""

    node_id: int
    server: SdoServer | None
    timeout_s: float
    retries: int


def _sdo_target(
    line: CliBus, node_id: int, sdo_channel: int, timeout_ms: int | None, retries: int | None
) -> _SdoTarget:
    timeout_s, times = line.sdo_policy(node_id)
    if timeout_ms is not None:
        timeout_s = timeout_ms / 1000
    return _SdoTarget(
        node_id, line.sdo_server(node_id, sdo_channel), timeout_s, times if retries is None else retries
    )


def _transfer(
    line: CliBus, target: _SdoTarget, index: int, sub: int, data: bytes | None, *, as_json: bool
) -> bytes:
    """Run the transfer. Raises ``OperationFailed`` with the abort text if the node refuses or is silent."""
    node_id, servers = target.node_id, KnownServers(line)
    known = servers.known()

    def make(now: float) -> SdoTask:
        return SdoTask(
            node_id,
            index,
            sub,
            data,
            now,
            target.timeout_s,
            retries=target.retries,
            server=target.server,
            known=known,
        )

    with progress(f"{index:04X}h:{sub:02X} of node {node_id}") as show:

        def watch(task: SdoTask) -> None:
            done, total = task.done_bytes, task.total_bytes
            show(done, total, f"{done} bytes" if total is None else f"{done} of {total} bytes")

        task = carry_out(line, make, watch)
    servers.learn(task.take_learned())
    if isinstance(task.result, bytes):
        return task.result
    if task.result is None:
        raise OperationFailed("interrupted")
    if as_json:
        print(json.dumps(_failure(node_id, task.result)))
    raise OperationFailed(f"node {node_id}: {task.result}")


def _failure(node_id: int, error: SdoError) -> dict[str, object]:
    return {
        "ok": False,
        "node": node_id,
        "index": f"{error.index:04X}",
        "sub": error.sub,
        "abort_code": f"{error.code:08X}",
        "message": str(error),
    }
