"""Parameters of a drive or node for the page, which reads and writes them by its tab: list, number of writes
of each, and sets of them as files."""

from __future__ import annotations

import asyncio
import logging
import tempfile
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path, PurePath
from typing import Any, Final

import msgspec
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from bridge.base.errors import FileFaults
from bridge.catalogue import Catalogue
from bridge.config import NodeTable
from bridge.image import Value
from bridge.mapping import Family
from bridge.northbound.page.guards import MOST_FILE
from bridge.northbound.page.refused import BodyTooLong, refused
from bridge.parameter import Names, ParameterEntry, backups
from bridge.parameter.backup_file import BackupFile
from bridge.parameter.factory import DESCRIPTIONS, factory
from bridge.parameter.set_file import read_set
from bridge.text import Text, as_json

Counts = Callable[[], Mapping[tuple[str, str], int]]
"""Writes to the EEPROM, by the drive's or node's name and the object."""
ReadBody = Callable[[Request, int], Awaitable[bytes]]
"""Reads the body of a request, of so many bytes at most; raises ``BodyTooLong`` or ``TimeoutError``."""

_log = logging.getLogger(__name__)

_SETS: Final = (".toml", *DESCRIPTIONS)
_MOST_FAULTS: Final = 20
"""Most faults of a file in one answer."""
_encode = msgspec.json.Encoder().encode


class _Set(msgspec.Struct, forbid_unknown_fields=True):
    """Parameters of a drive as a tab has read them. ``values`` are by name, ``unreadable`` gives the reason
    for each of the others."""

    values: dict[str, bool | int | float | str]
    missing: list[str] = []
    unreadable: dict[str, str] = {}
    identity: dict[str, int] = {}


_decode_set = msgspec.json.Decoder(_Set).decode


@dataclass(frozen=True, slots=True)
class Holder:
    """A drive, or a node that is none, with what its family says of its parameters."""

    name: str
    node: NodeTable
    family: Family
    names: Names
    on_first: bool


def holders_of(catalogue: Catalogue) -> dict[str, Holder]:
    """Drives and devices with parameters, by the names that commands have for them."""
    return {
        name: Holder(name, one.node, one.family, one.names, one.is_on_first)
        for name, one in catalogue.members.items()
    }


class ParameterPage:
    """``dictionaries`` are the makers' descriptions, by mapping. ``has_session`` says whether a request may
    read, ``has_token`` whether it comes from our page."""

    def __init__(
        self,
        holders: Mapping[str, Holder],
        counts: Counts,
        dictionaries: Mapping[str, Path],
        read_body: ReadBody,
        has_session: Callable[[Request], bool],
        has_token: Callable[[Request], bool],
    ) -> None:
        self._holders = holders
        self._counts = counts
        self._dictionaries = dictionaries
        self._factories: dict[str, dict[str, Value]] = {}
        self._read_body = read_body
        self._has_session = has_session
        self._has_token = has_token
        self._reading = asyncio.Semaphore(1)
        self.routes = [
            Route("/api/parameters/{holder:path}", self._list),
            Route("/api/backup/{holder:path}", self._backup, methods=["POST"]),
            Route("/api/set/{holder:path}", self._set, methods=["POST"]),
        ]

    def _refusal(self, request: Request) -> Response | None:
        if not self._has_session(request):
            return JSONResponse({"error": "login"}, 401)
        if request.method == "POST" and not self._has_token(request):
            return JSONResponse({"error": "token"}, 403)
        if request.path_params["holder"] not in self._holders:
            return refused(404, Text.of("page.there_is", known=tuple(self._holders)))
        return None

    async def _list(self, request: Request) -> Response:
        """List of the parameters, with the range and the wear of each."""
        if refusal := self._refusal(request):
            return refusal
        holder = self._holders[request.path_params["holder"]]
        async with self._reading:
            told = await asyncio.to_thread(lambda: listed(holder, self._counts(), self._factory(holder)))
        headers = {"cache-control": "no-store"}
        return Response(_encode(told), headers=headers, media_type="application/json")

    def _factory(self, holder: Holder) -> dict[str, Value]:
        """Factory settings by the maker's description; empty without one."""
        if holder.name not in self._factories:
            file = self._dictionaries.get(holder.node.mapping_key)
            try:
                found = factory(file, holder.names, holder.node.id, holder.node.modules) if file else {}
            except FileFaults as error:
                _log.warning("page: no factory settings of %s: %s", holder.name, error)
                found = {}
            self._factories[holder.name] = found
        return self._factories[holder.name]

    async def _backup(self, request: Request) -> Response:
        """Values that a tab has read, as a file that ``drivebridge parameters`` reads."""
        if refusal := self._refusal(request):
            return refusal
        holder = self._holders[request.path_params["holder"]]
        try:
            read = _decode_set(await self._read_body(request, MOST_FILE))
        except BodyTooLong as error:
            return refused(400, error.said)
        except (msgspec.DecodeError, TimeoutError, ValueError) as error:
            return refused(400, str(error))
        text = backup_of(holder, read.values, read.missing, read.unreadable, read.identity)
        name = f"{holder.name.replace('/', '-')}.toml"
        headers = {"content-disposition": f'attachment; filename="{name}"', "cache-control": "no-store"}
        return Response(text, headers=headers, media_type="application/toml")

    async def _set(self, request: Request) -> Response:
        """Answer with the values of a backup or device description that fit this drive."""
        if refusal := self._refusal(request):
            return refusal
        holder = self._holders[request.path_params["holder"]]
        name = PurePath(request.query_params.get("name", "").replace("\\", "/")).name or "file.toml"
        if PurePath(name).suffix.lower() not in _SETS:
            return refused(422, Text.of("page.set_ending", name=name[:80], endings=_SETS))
        try:
            content = await self._read_body(request, MOST_FILE)
        except BodyTooLong as error:
            return refused(400, error.said)
        except TimeoutError as error:
            return refused(400, str(error))
        async with self._reading:
            try:
                found = await asyncio.to_thread(_read, content, name, holder)
            except FileFaults as error:
                return refused(422, FileFaults(error.faults[:_MOST_FAULTS]).said)
        return Response(_encode(found), headers={"cache-control": "no-store"}, media_type="application/json")


def listed(
    holder: Holder, counts: Mapping[tuple[str, str], int], factory: Mapping[str, Value]
) -> dict[str, Any]:
    """Parameters for JSON, in the order of the mapping file, and what the family has for all of them."""
    settings = {entry.name for entry in backups.settings(holder.names, on_first=holder.on_first)}
    eeprom = holder.family.eeprom
    ram_only = eeprom.ram_only if eeprom else None
    return {
        "mapping": holder.node.mapping,
        "cycles": eeprom.cycles if eeprom else None,
        "can_save": bool(eeprom and eeprom.can_save),
        "on_save_only": bool(eeprom and eeprom.written_on_save_only),
        "ram_only": ram_only and {"parameter": ram_only.parameter, "value": ram_only.value},
        "parameters": [
            _entry(holder, entry, counts)
            | ({"setting": True} if entry.name in settings else {})
            | ({"factory": factory[entry.name]} if entry.name in factory else {})
            for entry in holder.names.entries()
            if holder.on_first or not (entry.definition and entry.definition.of_node)
        ],
    }


def backup_of(
    holder: Holder,
    values: Mapping[str, Value],
    missing: list[str],
    unreadable: Mapping[str, str],
    identity: Mapping[str, int],
) -> str:
    """The text of a file with those of ``values`` that belong into one, in the mapping file's order."""
    entries = backups.settings(holder.names, on_first=holder.on_first)
    saved = datetime.now(UTC).isoformat(timespec="seconds")
    content = BackupFile(
        holder.node.mapping,
        holder.name,
        saved,
        {entry.name: _as_held(entry, values[entry.name]) for entry in entries if entry.name in values},
        {entry.name: _comment(entry) for entry in entries},
        [entry.name for entry in entries if entry.name in missing],
        identity,
        {},
        {entry.name: unreadable[entry.name] for entry in entries if entry.name in unreadable},
        left_out=backups.left_out(holder.names, on_first=holder.on_first),
    )
    return content.text()


def _as_held(entry: ParameterEntry, value: Value) -> Value:
    """The value in the drive's type: JSON as browsers write it has 2 for 2.0."""
    is_whole = isinstance(value, int) and not isinstance(value, bool)
    return (
        float(value)
        if is_whole and entry.definition and not entry.definition.value_type.is_integer
        else value
    )


def _comment(entry: ParameterEntry) -> str:
    title = entry.definition.title if entry.definition else ""
    return f"{entry.unit}, {title}" if entry.unit else title


def _entry(holder: Holder, entry: ParameterEntry, counts: Mapping[tuple[str, str], int]) -> dict[str, Any]:
    """JSON object for one parameter; empty facts are left out."""
    definition = entry.definition
    if definition is None:
        return {"name": entry.name, "object": str(entry.address)}
    owner = holder.node.name if definition.of_node else holder.name
    why_never = holder.names.protection.why_never(entry) if definition.writable else None
    facts: dict[str, Any] = {
        "name": entry.name,
        "title": definition.title,
        "german": definition.german,
        "object": str(entry.address),
        "type": definition.data_type,
        "whole": definition.value_type.is_integer,
        "unit": definition.unit,
        "low": definition.low,
        "high": definition.high,
        "states": {str(code): text for code, text in definition.states.items()},
        "german_states": {str(code): text for code, text in definition.german_states.items()},
        "write_only": not definition.readable,
        "read_only": not definition.writable,
        "why_never": why_never and as_json(why_never),
        "protected": holder.names.protection.level(entry.address),
        "volatile": definition.volatile,
        "command": definition.command,
        "writes": counts.get((owner, str(entry.address)), 0),
    }
    return {name: fact for name, fact in facts.items() if fact not in ("", None, {}) and fact is not False}


def _read(content: bytes, name: str, holder: Holder) -> dict[str, Any]:
    """Parameters of a file. Raises ``FileFaults``, which name the file as the sender calls it."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"set{PurePath(name).suffix.lower()}"
        file.write_bytes(content)
        try:
            found = read_set(file, holder.names, holder.node.mapping, holder.name, holder.node.id)
        except FileFaults as error:
            raise FileFaults([replace(fault, file=name) for fault in error.faults]) from None
    values = {entry.name: value for entry, value in backups.in_order(holder.names, found.all)}
    return {"drive": found.drive, "saved": found.saved, "identity": dict(found.identity), "values": values}
