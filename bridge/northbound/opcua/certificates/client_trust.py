"""Trust in the certificates of OPC UA clients: the verdict as a status code and a line of the log."""

from __future__ import annotations

import os
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from cryptography import x509

from bridge.base import clock
from bridge.base.errors import Fault, FileFaults
from bridge.config import OpcUaTable
from bridge.northbound.opcua.certificates.own_certificate import reason
from bridge.northbound.opcua.certificates.own_files import CERTIFICATES
from bridge.text import Text
from bridge.trust import CertificateFault, Purpose, TrustStore, Verdict, judge
from bridge.trust.chain import named
from bridge.trust.files import MALFORMED, certificates_in, thumbprint
from bridge.uaserver.connections.security import Refused
from bridge.uaserver.library import StatusCodes, get

_LONGEST_NAME: Final = 40


def utc_now() -> datetime:
    return datetime.now(UTC)


def client_store(settings: OpcUaTable, state_dir: Path) -> TrustStore:
    """The folders of the site. Raises ``FileFaults`` for a ``trusted_dir`` that is none."""
    also = [Path(settings.trusted_dir)] if settings.trusted_dir else []
    for folder in also:
        try:
            with os.scandir(folder):
                pass
        except OSError as error:
            said, advice = Text.plain(reason(error)), Text.of("certificate.trusted_dir_advice")
            raise FileFaults([Fault(str(folder), 0, "", said, advice)]) from error
    return TrustStore(state_dir / CERTIFICATES, also)


class ClientTrust:
    """Judge of clients. With ``needs_trust`` False a certificate only has to be sound."""

    def __init__(
        self, store: TrustStore, *, needs_trust: bool, now: Callable[[], datetime] = utc_now
    ) -> None:
        self.store = store
        self._needs_trust = needs_trust
        self._now = now

    def refusal(self, sent: bytes, source: str, application_uri: str | None = None) -> Refused | None:
        """Refusal as in ``Trust.refusal``. What is refused is kept for people to look at."""
        try:
            certificates = certificates_in(sent)
        except MALFORMED:
            certificates = []
        if not certificates:
            return Refused(StatusCodes.BadSecurityChecksFailed, f"{CertificateFault.INVALID}: unreadable")
        purpose = Purpose(application_uri, needs_trust=self._needs_trust)
        verdict = judge(certificates, self.store.lists(), self._now(), purpose)
        if verdict.fault is None:
            return None
        self.store.keep_rejected(certificates, source, clock.now())
        code = (
            StatusCodes.BadSecurityChecksFailed if verdict.is_strangers else get(StatusCodes, verdict.fault)
        )
        return Refused(code, _line(certificates[0], verdict))


def _line(certificate: x509.Certificate, verdict: Verdict) -> str:
    """The fault, and the command that lets a stranger in."""
    line = f"{named(certificate)[:_LONGEST_NAME]}: {verdict}"
    if verdict.fault is not CertificateFault.UNTRUSTED:
        return line
    return f"{line}. drivebridge certificates trust SITE {thumbprint(certificate)}"
