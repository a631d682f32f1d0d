"""Certificates that a site file names: whether they are valid now, and where in the file the fault is."""

from __future__ import annotations

import logging
import re
from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from cryptography import x509

from bridge.base.errors import Fault, FileFaults
from bridge.text import Text
from bridge.tomlfile.lines import key_lines

_log = logging.getLogger(__name__)

_STEP: Final = re.compile(r"(\w+)|\[(\d+)\]")


def check_validity(file: str, certificate: x509.Certificate, advice: Text) -> None:
    """Raises ``FileFaults`` for one that has run out; ``advice`` says what to do then."""
    now = datetime.now(UTC)
    if certificate.not_valid_after_utc <= now:
        said = Text.of("certificate.ended", day=f"{certificate.not_valid_after_utc:%Y-%m-%d}")
        raise FileFaults([Fault(file, 0, "", said, advice)])
    if certificate.not_valid_before_utc > now:
        # Most often it is the clock of a box that has just been switched on.
        _log.warning("%s is not valid before %s: is the clock right?", file, certificate.not_valid_before_utc)


def placed(fault: Fault, keys: Mapping[str | None, str], site: Path) -> Fault:
    """The fault at the line of the site file's key that it is about; ``keys`` are those that name files, by
    the files."""
    if fault.file in keys:
        said = Text.of("certificate.of_file", file=fault.file, said=fault.said)
        fault = replace(fault, key=keys[fault.file], said=said)
    if not fault.key:
        return fault
    steps = [name or int(number) for name, number in _STEP.findall(fault.key)]
    lines = key_lines(site.read_text(encoding="utf-8"))
    line = next((lines[key] for n in range(len(steps), 0, -1) if (key := tuple(steps[:n])) in lines), 0)
    return replace(fault, file=str(site), line=line)
