"""Watch on the files of the server's own certificate, which may be renewed while it serves."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from pathlib import Path
from typing import Final

from bridge.base.errors import FileFaults
from bridge.config import OpcUaTable
from bridge.northbound.opcua.certificates.own_certificate import OwnCertificate, load_own, uris_of
from bridge.northbound.opcua.certificates.own_files import load_pair, own_pair
from bridge.trust.files import fingerprint

_log = logging.getLogger(__name__)

_EVERY_S: Final = 1.0
_Mark = tuple[int, int, int]


class RenewalWatch:
    """Files of the certificate of ``application_uri``, in ``folder`` unless the site file names others."""

    def __init__(self, settings: OpcUaTable, folder: Path, application_uri: str) -> None:
        self._settings = settings
        self._folder = folder
        self._uri = application_uri
        self._seen = self._marks()

    def look(self) -> OwnCertificate | None:
        """The certificate, where it has been replaced by one that can be used. To be called in a thread."""
        marks = self._marks()
        if marks == self._seen or None in marks:
            return None
        self._seen = marks
        certificate, key = own_pair(self._settings, self._folder)
        try:
            own = load_own(certificate, key) if self._settings.certificate else load_pair(self._folder)
        except (FileFaults, OSError) as error:
            # Of two files that are replaced one after the other, the second comes in a moment.
            _log.warning("%s is not taken up: %s", certificate, error)
            return None
        if self._uri not in (uris := uris_of(own.certificate) or [self._uri]):
            _log.warning("%s is not taken up: it is that of %s, not of %s", certificate, uris[0], self._uri)
            return None
        _log.info("OPC UA: %s is taken up, SHA-256 %s", certificate, fingerprint(own.certificate))
        return own

    async def run(self, renew: Callable[[OwnCertificate], None]) -> None:
        """Look every second, and have what has come taken up."""
        while True:
            await asyncio.sleep(_EVERY_S)
            own = await asyncio.to_thread(self.look)
            if own:
                renew(own)

    def _marks(self) -> tuple[_Mark | None, ...]:
        return tuple(map(_mark, own_pair(self._settings, self._folder)))


def _mark(file: Path) -> _Mark | None:
    try:
        found = file.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size, found.st_ino
