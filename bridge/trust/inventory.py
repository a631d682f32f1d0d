"""List of the certificates of an installation, for people: where each is, until when, and what is wrong."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from cryptography import x509

from bridge.text import Said
from bridge.trust.chain import short
from bridge.trust.files import MALFORMED, fingerprint, thumbprint
from bridge.trust.judge import Purpose, judge
from bridge.trust.store import ISSUERS, OWN, REJECTED, TRUSTED, TrustStore
from bridge.trust.verdict import CertificateFault, Verdict

_OF_DAYS = (CertificateFault.TIME, CertificateFault.ISSUER_TIME)


@dataclass(frozen=True, slots=True)
class Listed:
    """One certificate. ``place`` is its folder, ``since`` and ``until`` are the bounds of its validity, UTC;
    ``fault`` is empty where nothing is wrong, and ``said`` the fault for people."""

    place: str
    file: Path
    thumbprint: str
    fingerprint: str
    subject: str
    since: datetime
    until: datetime
    fault: str = ""
    said: Said = ""


def inventory(store: TrustStore, now: datetime) -> Iterator[Listed]:
    """Certificates in the folders; those that were refused with what stands against them at present."""
    lists = store.lists()
    for place, folder in ((OWN, store.own), (TRUSTED, store.trusted), (ISSUERS, store.issuers)):
        for file, content in store.files(folder):
            if isinstance(content, x509.Certificate):
                verdict = judge([content], lists, now, Purpose(needs_trust=False))
                # Whether it may be a client's is asked of clients only.
                yield from _listed(place, file, content, verdict if verdict.fault in _OF_DAYS else Verdict())
    for one in store.rejected_ones():
        yield from _listed(REJECTED, one.file, one.certificate, judge(one.sent, lists, now))


def _listed(place: str, file: Path, certificate: x509.Certificate, verdict: Verdict) -> Iterator[Listed]:
    try:
        subject = certificate.subject.rfc4514_string()
        bounds = certificate.not_valid_before_utc, certificate.not_valid_after_utc
    except MALFORMED:
        return
    fault = str(verdict.fault or "")
    prints = thumbprint(certificate), fingerprint(certificate)
    yield Listed(place, file, *prints, short(subject), *bounds, fault, verdict.said)
