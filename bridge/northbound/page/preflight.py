"""Check of what the page needs of the disk, before a bus is opened."""

from __future__ import annotations

import ssl
from pathlib import Path
from typing import Final

from cryptography import x509

from bridge.base.errors import Fault, FileFaults
from bridge.config import PageTable
from bridge.northbound.certificatefiles import check_validity, placed
from bridge.text import Text

_PEM: Final = Text.of("certificate.pem_chain_advice")


def check_page(table: PageTable, site: Path) -> None:
    """Check the files. Raises ``FileFaults`` for a certificate or key that cannot be used."""
    if table.certificate is None or table.private_key is None:
        return
    keys: dict[str | None, str] = {
        table.certificate: "page.certificate",
        table.private_key: "page.private_key",
    }
    try:
        _check_pair(table.certificate, table.private_key)
    except FileFaults as error:
        raise FileFaults([placed(fault, keys, site) for fault in error.faults]) from None


def _check_pair(certificate: str, private_key: str) -> None:
    contents: list[bytes] = []
    for file in (certificate, private_key):
        try:
            contents.append(Path(file).read_bytes())
        except OSError as error:
            reason = (error.strerror or str(error)).lower()
            said = Text.of("certificate.unusable", why=reason)
            raise FileFaults([Fault(file, 0, "", said, _PEM)]) from None
    try:
        loaded = x509.load_pem_x509_certificate(contents[0])
    except ValueError:
        said = Text.of("certificate.holds_none")
        raise FileFaults([Fault(certificate, 0, "", said, _PEM)]) from None
    try:
        ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(certificate, private_key, password="")
    except ssl.SSLError as error:
        if error.reason == "KEY_VALUES_MISMATCH":
            said = Text.of("certificate.not_its_key", certificate=certificate)
        else:
            said = Text.of("certificate.holds_no_key")
        raise FileFaults([Fault(private_key, 0, "", said, Text.of("certificate.pem_advice"))]) from None
    check_validity(certificate, loaded, Text.of("certificate.renew_page_advice"))
