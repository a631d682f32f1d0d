"""``eds``: look at a device description, and what it configures, without a bus."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from bridge.base.errors import OperationFailed
from bridge.cli.terminal import printable
from bridge.config.download import Download, to_concise_dcf
from bridge.eds import Description, Entry, Finding, Value, configuration, read_device_file
from bridge.eds.model import Report
from bridge.eds.pdos import PdoSummary, pdos


class Format(StrEnum):
    TEXT = "text"
    CANOPEN = "canopen"


def eds(
    file: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="an EDS, DCF, XDD or XDC; with --format canopen a family too"),
    ],
    node_id: Annotated[
        int | None, typer.Option(min=1, max=127, help="the node id that $NODEID stands for")
    ] = None,
    module: Annotated[
        list[str] | None,
        typer.Option(help="a module that is plugged in, by order code, name or number; in their order"),
    ] = None,
    concise: Annotated[
        Path | None, typer.Option(help="write what the file configures as a concise DCF (1F22h)")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="machine-readable")] = False,
    form: Annotated[
        Format,
        typer.Option("--format", help="canopen: the EDS that python-canopen reads, with units and factors"),
    ] = Format.TEXT,
) -> None:
    """Read FILE even if it has faults; print what it describes and what was wrong with it."""
    if form is Format.CANOPEN:
        if concise or as_json or module:
            message = "goes with none of --concise, --json and --module"
            raise typer.BadParameter(message, param_hint="--format canopen")
        print(_canopen_eds()(str(file), node_id), end="")
        return
    description = read_device_file(file, module or ())
    node_id = node_id or description.commissioning.node_id
    report = Report()
    downloads = configuration(description, node_id, report)
    findings = (*description.findings, *report.findings())
    if concise:
        _write(concise, to_concise_dcf(downloads))
    if as_json:
        print(json.dumps(_as_json(description, downloads, findings, node_id), indent=2))
        return
    for line in _lines(file, description, downloads, findings, node_id):
        print(printable(line))


def _canopen_eds() -> Callable[[str, int | None], str]:
    """Raises OperationFailed where canopen is missing: it is an extra, because nothing else needs it."""
    try:
        from bridge.dictionary import as_eds, load_dictionary
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] != "canopen":
            raise
        raise OperationFailed(
            "an object dictionary for canopen needs that package, which is not installed: "
            f"`{sys.executable} -m pip install canopen` (or install drivebridge as drivebridge[canopen])"
        ) from None
    return lambda what, node_id: as_eds(load_dictionary(what, node_id))


def _write(path: Path, content: bytes) -> None:
    try:
        path.write_bytes(content)
    except OSError as error:
        raise OperationFailed(f"{path} cannot be written: {error.strerror}") from error


def _lines(
    file: Path,
    description: Description,
    downloads: Sequence[Download],
    findings: Sequence[Finding],
    node_id: int | None,
) -> list[str]:
    info, commissioning = description.device_info, description.commissioning
    named = " ".join(text for text in (info.vendor, info.product, info.order_code) if text)
    entries = sum(len(one.entries) for one in description.objects)
    lines = [
        f"{file}: {description.format}, {named or 'a device without a name'}",
        f"  vendor id {_hex(info.vendor_id)}, product code {_hex(info.product_code)}, "
        f"revision {_hex(info.revision)}",
        f"  {len(description.objects)} objects with {entries} entries",
    ]
    if info.bitrates:
        rates = ", ".join(f"{rate // 1000}" for rate in info.bitrates)
        lines.append(f"  bit rates {rates} kbit/s")
    if commissioning.node_id is not None or commissioning.node_name:
        name = f" {commissioning.node_name}" if commissioning.node_name else ""
        lines.append(f"  for node {commissioning.node_id}{name}")
    for one in description.modules:
        times = description.plugged.count(one.number)
        lines.append(f"  module {one}" + (f", plugged in {times} ×" if times else ""))
    lines += [f"  {_pdo_line(pdo)}" for pdo in pdos(description, node_id)]
    if downloads:
        lines.append(f"  configures {len(downloads)} objects:")
        lines += [f"    {one.name} = {one.data.hex(' ').upper()}" for one in downloads]
    lines += [f"{file}:{one.line}: {one.severity}: {one.said}" for one in findings]
    return lines


def _pdo_line(pdo: PdoSummary) -> str:
    cob_id = pdo.cob_id_text if pdo.cob_id is None else f"{pdo.cob_id:X}h"
    state = "" if pdo.enabled else ", off"
    mapped = ", ".join(
        f"{one.index:04X}:{one.sub:02X}/{one.bits}" + (f" {one.name}" if one.name else "")
        for one in pdo.mapped
    )
    kind = "?" if pdo.transmission_type is None else pdo.transmission_type
    return f"{pdo.name} {cob_id}{state}, type {kind}: {mapped or 'nothing'}"


def _hex(number: int | None) -> str:
    return "not given" if number is None else f"{number:08X}h"


def _as_json(
    description: Description,
    downloads: Sequence[Download],
    findings: Sequence[Finding],
    node_id: int | None,
) -> dict[str, Any]:
    return {
        "format": description.format,
        "device": asdict(description.device_info),
        "modules": [asdict(one) for one in description.modules],
        "plugged": list(description.plugged),
        "node_id": node_id,
        "node_name": description.commissioning.node_name,
        "objects": [_entry_json(entry, node_id) for one in description.objects for entry in one.entries],
        "pdos": [_pdo_json(pdo) for pdo in pdos(description, node_id)],
        "downloads": [{"index": one.index, "sub": one.sub, "data": one.data.hex()} for one in downloads],
        "findings": [{"line": one.line, "severity": one.severity, "text": str(one.said)} for one in findings],
    }


def _entry_json(entry: Entry, node_id: int | None) -> dict[str, Any]:
    return {
        "index": entry.index,
        "sub": entry.sub,
        "name": entry.name,
        "type": entry.data_type.name if entry.data_type else None,
        "access": entry.access.value,
        "default": _value(entry.default, node_id),
        "value": _value(entry.parameter_value, node_id),
        "low": _value(entry.low, node_id),
        "high": _value(entry.high, node_id),
        "pdo_mappable": entry.pdo_mappable,
    }


def _value(value: Value | None, node_id: int | None) -> int | float | str | None:
    """The value on this node; as written in the file if it needs a node id and none is known."""
    if value is None:
        return None
    plain = value.at(node_id)
    return str(value) if plain is None or isinstance(plain, bytes) else plain


def _pdo_json(pdo: PdoSummary) -> dict[str, Any]:
    return {
        "name": pdo.name,
        "enabled": pdo.enabled,
        "cob_id": pdo.cob_id,
        "transmission_type": pdo.transmission_type,
        "inhibit_ms": pdo.inhibit_100us / 10,
        "event_ms": pdo.event_timer_ms,
        "mapped": [asdict(one) for one in pdo.mapped],
    }
