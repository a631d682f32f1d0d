"""Checks before a bus is opened: a bridge that cannot go on must not move a drive."""

from __future__ import annotations

import errno
import logging
import tempfile
from pathlib import Path
from typing import Final

from bridge.base.errors import Unavailable
from bridge.config import Site
from bridge.service.fronts import FRONTS

_log = logging.getLogger(__name__)

_PROBE: Final = bytes(4096)
_FULL: Final = (errno.ENOSPC, errno.EDQUOT)


def check_files(site: Site, path: Path, *, fronts: bool) -> None:
    """Check files and folders of the site at ``path``, with ``fronts`` also what its fronts need. Raises
    ``FileFaults`` and ``Unavailable``."""
    _check_state_folder(Path(site.site.state_dir))
    for kind in FRONTS if fronts else ():
        kind.check_files(site, path)


def _check_state_folder(folder: Path) -> None:
    """Raise ``Unavailable`` if nothing can be written. A full disk is only reported: it costs lines of the
    audit log and counts of the EEPROM guard, and must not stop a plant."""
    try:
        folder.mkdir(mode=0o750, parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as probe:
            probe.write(_PROBE)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        if error.errno in _FULL:
            _log.error(
                "site.state_dir = %r: %s: audit log and EEPROM counts are not kept", str(folder), reason
            )
            return
        hint = "it must be a folder that the service can write to"
        raise Unavailable(f"site.state_dir = {str(folder)!r}: {reason} ({hint})") from None
