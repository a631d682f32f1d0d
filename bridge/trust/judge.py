"""Judgement of a peer's certificate, in the order of OPC 10000-4 §6.1.3, Table 100. Sans-IO.

Names, signatures and extensions are read and verified by ``cryptography``; here is only what has to be true
of them, one step after the other, so that each fault has its own code.
"""

from __future__ import annotations

import ipaddress
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import pairwise
from typing import Final, TypeVar

from cryptography import x509
from cryptography.exceptions import UnsupportedAlgorithm
from cryptography.hazmat.primitives.asymmetric.rsa import RSAPublicKey
from cryptography.x509.oid import ExtendedKeyUsageOID

from bridge.text import Text
from bridge.trust.chain import TrustLists, chain_of, named, short
from bridge.trust.verdict import TRUSTED, CertificateFault, Faulty, Verdict

_KEY_BITS: Final = (2048, 4096)
"""Length of RSA keys that the policies from Basic256Sha256 on allow (OPC 10000-7 §6.6)."""
_HASHES: Final = ("sha256", "sha384", "sha512")
_UNREADABLE: Final = (ValueError, TypeError, OverflowError, x509.InvalidVersion)
_Extension = TypeVar("_Extension", bound=x509.ExtensionType)


@dataclass(frozen=True, slots=True)
class Purpose:
    """Use that a certificate is for: a client, with ``is_user`` the person at it.

    ``application_uri`` and ``host`` have to be in it where they are given. With ``needs_trust`` False nobody
    has to have said that it is trusted, and its issuers do not count.
    """

    application_uri: str | None = None
    host: str | None = None
    is_user: bool = False
    needs_trust: bool = True


CLIENT: Final = Purpose()


def judge(
    sent: Sequence[x509.Certificate], lists: TrustLists, now: datetime, purpose: Purpose = CLIENT
) -> Verdict:
    """Verdict on the first of the certificates that a peer has ``sent``; the others may be its issuers.
    ``now`` is UTC."""
    try:
        _judge(sent, lists, now, purpose)
    except Faulty as found:
        return found.verdict
    except (*_UNREADABLE, UnsupportedAlgorithm):
        # Parts of a certificate are read when they are looked at.
        return Verdict(CertificateFault.INVALID, Text.of("trust.unreadable"))
    return TRUSTED


def _judge(sent: Sequence[x509.Certificate], lists: TrustLists, now: datetime, purpose: Purpose) -> None:
    for certificate in sent:
        _read_whole(certificate)
    chain = chain_of(sent, lists) if purpose.needs_trust else list(sent[:1])
    if not chain:
        raise Faulty(CertificateFault.INVALID, Text.of("trust.unreadable"))
    for certificate in chain:
        _check_algorithms(certificate)
    if purpose.needs_trust and not any(lists.trusts(one) for one in chain):
        raise Faulty(CertificateFault.UNTRUSTED, Text.of("trust.untrusted"))
    for place, certificate in enumerate(chain):
        _check_time(certificate, now, CertificateFault.ISSUER_TIME if place else CertificateFault.TIME)
    _check_names(chain[0], purpose)
    _check_use(chain[0], purpose)
    for below, certificate in enumerate(chain[1:]):
        _check_issuer_use(certificate, below)
    for place, (certificate, issuer) in enumerate(pairwise(chain)):
        _check_revocation(certificate, issuer, lists, now, is_issuer=place > 0)


def _read_whole(certificate: x509.Certificate) -> None:
    """Raises one of ``_UNREADABLE`` for a certificate of which a part is malformed."""
    list(certificate.extensions)
    certificate.subject.rfc4514_string()
    certificate.issuer.rfc4514_string()


def _check_algorithms(certificate: x509.Certificate) -> None:
    name = named(certificate)
    key = certificate.public_key()
    if not isinstance(key, RSAPublicKey):
        raise Faulty(CertificateFault.POLICY, Text.of("trust.not_rsa", name=name))
    least, most = _KEY_BITS
    if not least <= key.key_size <= most:
        said = Text.of("trust.key_bits", name=name, bits=key.key_size, least=least, most=most)
        raise Faulty(CertificateFault.POLICY, said)
    algorithm = certificate.signature_hash_algorithm
    if algorithm is None or algorithm.name not in _HASHES:
        raise Faulty(CertificateFault.POLICY, Text.of("trust.algorithm", name=name))


def _check_time(certificate: x509.Certificate, now: datetime, fault: CertificateFault) -> None:
    name = named(certificate)
    if now < certificate.not_valid_before_utc:
        day = f"{certificate.not_valid_before_utc:%Y-%m-%d}"
        raise Faulty(fault, Text.of("trust.not_yet", name=name, day=day))
    if now > certificate.not_valid_after_utc:
        day = f"{certificate.not_valid_after_utc:%Y-%m-%d}"
        raise Faulty(fault, Text.of("trust.ended", name=name, day=day))


def _check_names(certificate: x509.Certificate, purpose: Purpose) -> None:
    names = _extension(certificate, x509.SubjectAlternativeName)
    if purpose.host is not None and not _is_host(purpose.host, names):
        raise Faulty(CertificateFault.HOST_NAME, Text.of("trust.host_name", host=short(purpose.host)))
    uri = purpose.application_uri
    if uri is not None and uri not in uris_in(certificate):
        raise Faulty(CertificateFault.URI, Text.of("trust.uri", uri=short(uri)))


def uris_in(certificate: x509.Certificate) -> list[str]:
    """Application URIs in the certificate. Raises ValueError for one whose extensions are malformed."""
    names = _extension(certificate, x509.SubjectAlternativeName)
    return names.get_values_for_type(x509.UniformResourceIdentifier) if names else []


def _is_host(host: str, names: x509.SubjectAlternativeName | None) -> bool:
    if names is None:
        return False
    try:
        return ipaddress.ip_address(host) in names.get_values_for_type(x509.IPAddress)
    except ValueError:
        return host.lower() in [one.lower() for one in names.get_values_for_type(x509.DNSName)]


def _check_use(certificate: x509.Certificate, purpose: Purpose) -> None:
    """Uses that it names for itself; who names none may be used for all (RFC 5280 §4.2.1.3)."""
    usage = _extension(certificate, x509.KeyUsage)
    may_sign = usage is None or usage.digital_signature
    may_encrypt = usage is None or usage.data_encipherment or purpose.is_user
    extended = _extension(certificate, x509.ExtendedKeyUsage)
    known = (ExtendedKeyUsageOID.CLIENT_AUTH, ExtendedKeyUsageOID.ANY_EXTENDED_KEY_USAGE)
    is_client = extended is None or purpose.is_user or any(use in known for use in extended)
    if not (may_sign and may_encrypt and is_client):
        raise Faulty(CertificateFault.USE, Text.of("trust.use", name=named(certificate)))


def _check_issuer_use(certificate: x509.Certificate, below: int) -> None:
    """``below`` counts the issuers between it and the certificate that is judged."""
    constraints = _extension(certificate, x509.BasicConstraints)
    usage = _extension(certificate, x509.KeyUsage)
    is_issuer = constraints is not None and constraints.ca and (usage is None or usage.key_cert_sign)
    is_deep = (
        constraints is not None and constraints.path_length is not None and below > constraints.path_length
    )
    if not is_issuer or is_deep:
        raise Faulty(CertificateFault.ISSUER_USE, Text.of("trust.issuer_use", name=named(certificate)))


def _check_revocation(
    certificate: x509.Certificate,
    issuer: x509.Certificate,
    lists: TrustLists,
    now: datetime,
    *,
    is_issuer: bool,
) -> None:
    """The issuer's revocation list has to be there, and of today: without it nobody knows."""
    unknown = CertificateFault.REVOCATION_UNKNOWN
    revoked = CertificateFault.REVOKED
    if is_issuer:
        unknown, revoked = CertificateFault.ISSUER_REVOCATION_UNKNOWN, CertificateFault.ISSUER_REVOKED
    crl = next(lists.crls_of(issuer), None)
    if crl is None:
        raise Faulty(unknown, Text.of("trust.no_crl", issuer=named(issuer)))
    # An old list still knows what was revoked.
    if crl.get_revoked_certificate_by_serial_number(certificate.serial_number) is not None:
        raise Faulty(revoked, Text.of("trust.revoked", name=named(certificate)))
    if crl.next_update_utc is not None and crl.next_update_utc < now:
        day = f"{crl.next_update_utc:%Y-%m-%d}"
        raise Faulty(unknown, Text.of("trust.crl_ended", issuer=named(issuer), day=day))


def _extension(certificate: x509.Certificate, kind: type[_Extension]) -> _Extension | None:
    try:
        return certificate.extensions.get_extension_for_class(kind).value
    except x509.ExtensionNotFound:
        return None
