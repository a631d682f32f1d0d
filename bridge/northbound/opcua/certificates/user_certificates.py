"""Users who log in with a certificate of their own: the site file names its file."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from pathlib import Path

from cryptography import x509

from bridge.base.errors import Fault, FileFaults
from bridge.config import OpcUaTable, UserTable
from bridge.northbound.opcua.certificates.own_certificate import read_certificate, reason
from bridge.text import Text
from bridge.trust import Purpose, TrustLists, Verdict, judge
from bridge.trust.files import MALFORMED, der


def user_certificates(settings: OpcUaTable) -> Mapping[bytes, UserTable]:
    """Users by their certificates in DER. Raises ``FileFaults`` for files that cannot be used."""
    faults: list[Fault] = []
    found: dict[bytes, UserTable] = {}
    for user in settings.user:
        if not user.certificate:
            continue
        try:
            content = der(read_certificate(Path(user.certificate)))
        except (OSError, *MALFORMED) as error:
            said = Text.of("certificate.unusable", why=reason(error))
            faults.append(Fault(user.certificate, 0, "", said, Text.of("certificate.x509_advice")))
            continue
        if content in found:
            said = Text.of("certificate.of_another_user", name=found[content].name)
            faults.append(Fault(user.certificate, 0, "", said))
        found[content] = user
    if faults:
        raise FileFaults(faults)
    return found


def judge_user(certificate: x509.Certificate, lists: TrustLists, now: datetime) -> Verdict:
    """Verdict on a certificate that the site file names; ``lists`` has its issuers and what they revoked."""
    known = TrustLists([certificate], (*lists.trusted, *lists.issuers), lists.crls)
    return judge([certificate], known, now, Purpose(is_user=True))
