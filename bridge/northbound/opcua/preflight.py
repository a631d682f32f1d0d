"""Check of what the OPC UA server needs of the site file and the disk, before a bus is opened.

The bus process does it, so asyncua is not imported here.
"""

from __future__ import annotations

from pathlib import Path

from bridge.base.errors import FileFaults
from bridge.config import OpcUaTable
from bridge.northbound.certificatefiles import check_validity, placed
from bridge.northbound.opcua.certificates.client_trust import client_store
from bridge.northbound.opcua.certificates.own_files import own_folder
from bridge.northbound.opcua.certificates.server_identity import server_identity
from bridge.northbound.opcua.certificates.user_certificates import user_certificates
from bridge.northbound.passwords import check_users
from bridge.text import Text


def check_opcua(settings: OpcUaTable, state_dir: Path, site: Path) -> None:
    """Check the files. Raises ``FileFaults`` for users, certificates, key or ``trusted_dir`` that cannot be
    used, and ``Unavailable`` where ``state_dir`` does not take what has to be made."""
    try:
        check_users(settings.user)
        own = server_identity(settings, own_folder(state_dir))
        client_store(settings, state_dir).prepare()
        user_certificates(settings)
        if settings.certificate:
            advice = Text.of("certificate.renew_opcua_advice")
            check_validity(settings.certificate, own.certificate, advice)
    except FileFaults as error:
        keys = {
            settings.certificate: "opcua.certificate",
            settings.private_key: "opcua.private_key",
            settings.trusted_dir: "opcua.trusted_dir",
            **{user.certificate: f"opcua.user[{n}].certificate" for n, user in enumerate(settings.user)},
        }
        raise FileFaults([placed(fault, keys, site) for fault in error.faults]) from None
