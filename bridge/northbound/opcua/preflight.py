"""What the OPC UA server needs of the site file and the disk, looked at before a bus is opened.

The bus process does it, so asyncua is not imported here.
"""

from __future__ import annotations

import logging
import re
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from cryptography import x509

from bridge.config import OpcUaTable
from bridge.errors import Fault, FileFaults
from bridge.northbound.opcua.certificates import TrustedCertificates, application_uri, configured_or_own
from bridge.northbound.opcua.passwords import check_users
from bridge.tomlfile.lines import key_lines

_log = logging.getLogger(__name__)

_STEP: Final = re.compile(r"(\w+)|\[(\d+)\]")


def check_opcua(settings: OpcUaTable, state_dir: Path, site: Path) -> None:
    """Raises ``FileFaults`` for users, certificate, key or ``trusted_dir`` that cannot be used, and
    ``Unavailable`` where a certificate has to be made and ``state_dir`` does not take it."""
    try:
        check_users(settings.user)
        own = configured_or_own(settings, state_dir / "opcua", application_uri())
        if settings.trusted_dir:
            TrustedCertificates(Path(settings.trusted_dir))
        if settings.certificate:
            _check_validity(settings.certificate, own.certificate)
    except FileFaults as error:
        raise FileFaults([_placed(fault, settings, site) for fault in error.faults]) from None


def _check_validity(file: str, certificate: x509.Certificate) -> None:
    now = datetime.now(UTC)
    if certificate.not_valid_after_utc <= now:
        message = f"was valid until {certificate.not_valid_after_utc:%Y-%m-%d}"
        hint = "renew it, or leave out certificate and private_key: the bridge makes its own"
        raise FileFaults([Fault(file, 0, "", message, hint)])
    if certificate.not_valid_before_utc > now:
        # Most often it is the clock of a box that has just been switched on.
        _log.warning("%s is not valid before %s: is the clock right?", file, certificate.not_valid_before_utc)


def _placed(fault: Fault, settings: OpcUaTable, site: Path) -> Fault:
    """The fault at the line of the key that it is about, where that is one of the site file."""
    files = {
        settings.certificate: "opcua.certificate",
        settings.private_key: "opcua.private_key",
        settings.trusted_dir: "opcua.trusted_dir",
    }
    if fault.file in files:
        fault = replace(fault, key=files[fault.file], message=f"{fault.file} {fault.message}")
    if not fault.key:
        return fault
    steps = [name or int(number) for name, number in _STEP.findall(fault.key)]
    lines = key_lines(site.read_text(encoding="utf-8"))
    line = next((lines[key] for n in range(len(steps), 0, -1) if (key := tuple(steps[:n])) in lines), 0)
    return replace(fault, file=str(site), line=line)
