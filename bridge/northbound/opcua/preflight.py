"""Check of what the OPC UA server needs of the site file and the disk, before a bus is opened.

The bus process does it, so asyncua is not imported here.
"""

from __future__ import annotations

from pathlib import Path

from bridge.base.errors import FileFaults
from bridge.config import OpcUaTable
from bridge.northbound.certificatefiles import check_validity, placed
from bridge.northbound.opcua.certificates import TrustedCertificates
from bridge.northbound.opcua.server_identity import server_identity
from bridge.northbound.passwords import check_users
from bridge.text import Text


def check_opcua(settings: OpcUaTable, state_dir: Path, site: Path) -> None:
    """Check the files. Raises ``FileFaults`` for users, certificate, key or ``trusted_dir`` that cannot be
    used, and ``Unavailable`` where a certificate has to be made and ``state_dir`` does not take it."""
    try:
        check_users(settings.user)
        own = server_identity(settings, state_dir / "opcua")
        if settings.trusted_dir:
            TrustedCertificates(Path(settings.trusted_dir))
        if settings.certificate:
            advice = Text.of("certificate.renew_opcua_advice")
            check_validity(settings.certificate, own.certificate, advice)
    except FileFaults as error:
        keys = {
            settings.certificate: "opcua.certificate",
            settings.private_key: "opcua.private_key",
            settings.trusted_dir: "opcua.trusted_dir",
        }
        raise FileFaults([placed(fault, keys, site) for fault in error.faults]) from None
