"""Lessons about SDO servers, from one command to the next: ``sdo-servers.json``.

In the site's ``state_dir``; without a site in the user's own state folder (XDG). What is a month old counts
no more: the device may have another program by then.
"""

from __future__ import annotations

import os
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Final

import msgspec

from bridge.cli.bus_runner import CliBus, tell

NAME: Final = "sdo-servers.json"
_KEPT_S: Final = 30 * 86_400.0


class _KnownServer(msgspec.Struct):
    """Reason why a server is not asked for block transfer, and when that was found out, in seconds since
    1970."""

    why_no_block: str
    since: float


class _KnownServersFile(msgspec.Struct):
    """Servers by bus, then by the COB-ID of requests."""

    servers: dict[str, dict[int, _KnownServer]] = msgspec.field(
        default_factory=dict[str, dict[int, _KnownServer]]
    )


class KnownServers:
    """The servers of one bus."""

    def __init__(self, line: CliBus) -> None:
        folder = line.state_dir or _own_folder()
        self.path = folder / NAME
        self._bus = line.table.name if line.is_of_site else f"{line.table.interface} {line.table.channel}"

    def known(self) -> Mapping[int, str]:
        """Reason why a server is not asked for block transfer, by the COB-ID of its requests."""
        servers = self._read().servers.get(self._bus, {})
        return {
            request_id: one.why_no_block
            for request_id, one in servers.items()
            if time.time() - one.since < _KEPT_S
        }

    def learn(self, learned: Mapping[int, str]) -> None:
        """Say it, and keep it. Where it cannot be kept it is found out, and said, the next time again."""
        if not learned:
            return
        for why in learned.values():
            tell(f"block transfer is not used any more: {why}")
        kept = self._read()
        servers = kept.servers.setdefault(self._bus, {})
        for request_id, why in learned.items():
            servers[request_id] = _KnownServer(why, time.time())
        try:
            self._write(kept)
        except OSError as error:
            tell(f"{self.path} cannot be written: {error.strerror}; it will be asked for again")

    def _read(self) -> _KnownServersFile:
        """Empty where there is no file that can be read: it is found out anew."""
        try:
            return msgspec.json.decode(self.path.read_bytes(), type=_KnownServersFile)
        except (OSError, msgspec.MsgspecError, UnicodeDecodeError):
            return _KnownServersFile()

    def _write(self, kept: _KnownServersFile) -> None:
        self.path.parent.mkdir(parents=True, exist_ok=True)
        new = self.path.with_name(f".{NAME}.{os.getpid()}")
        new.write_bytes(msgspec.json.format(msgspec.json.encode(kept), indent=1))
        new.replace(self.path)


def _own_folder() -> Path:
    given = os.environ.get("XDG_STATE_HOME", "")
    return (Path(given) if given else Path.home() / ".local" / "state") / "drivebridge"
