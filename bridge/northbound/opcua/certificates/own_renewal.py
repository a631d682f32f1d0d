"""Renewal of the server's own certificate by a client: a request for an authority, and what comes back."""

from __future__ import annotations

from datetime import datetime
from typing import Final

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives.asymmetric.rsa import RSAPrivateKey
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.serialization import Encoding, load_pem_private_key

from bridge.northbound.opcua.certificates.own_certificate import OwnCertificate
from bridge.northbound.opcua.certificates.ownnames import general_name
from bridge.northbound.opcua.certificates.selfsigned import generate_key
from bridge.trust import Purpose, TrustLists, judge
from bridge.trust.files import MALFORMED
from bridge.uaserver.library import ServiceError, StatusCodes, get

PEM: Final = "PEM"
_LEAST_NONCE: Final = 32
"""Bytes of a client's own chance for a new key (OPC 10000-12 §7.10.8)."""


class OwnRenewal:
    """Renewal of the certificate ``own`` of the application ``uri``, reached by ``names``; ``pending`` is not
    in use yet."""

    def __init__(self, own: OwnCertificate, uri: str, names: list[str]) -> None:
        self.own = own
        self.pending: OwnCertificate | None = None
        self._uri = uri
        self._names = names
        self._next_key: RSAPrivateKey | None = None

    def request(self, subject: str, nonce: bytes, *, new_key: bool) -> bytes:
        """A certificate signing request (PKCS #10) in DER; takes a moment for a new key. Raises ServiceError
        for a subject that is none, and for too short a nonce."""
        if new_key and len(nonce) < _LEAST_NONCE:
            raise ServiceError(StatusCodes.BadInvalidArgument)
        name = _name(subject) if subject else self.own.certificate.subject
        if new_key:
            self._next_key = generate_key()
        known_by = [x509.UniformResourceIdentifier(self._uri), *map(general_name, self._names)]
        builder = x509.CertificateSigningRequestBuilder(name)
        builder = builder.add_extension(x509.SubjectAlternativeName(known_by), critical=False)
        key = self._next_key if self._next_key and new_key else self.own.private_key
        return builder.sign(key, SHA256()).public_bytes(Encoding.DER)

    def update(
        self, content: bytes, issuers: list[bytes], key_format: str, key: bytes, now: datetime
    ) -> None:
        """Take a certificate that an authority has made, with its key where that is not ours. Raises
        ServiceError for one that cannot be used."""
        try:
            certificate = x509.load_der_x509_certificate(content)
            above = [x509.load_der_x509_certificate(one) for one in issuers]
        except MALFORMED:
            raise ServiceError(StatusCodes.BadCertificateInvalid) from None
        purpose = Purpose(self._uri, is_user=True, needs_trust=False)
        verdict = judge([certificate], TrustLists(), now, purpose)
        if verdict.fault:
            raise ServiceError(get(StatusCodes, verdict.fault))
        if above and not any(_has_issued(one, certificate) for one in above):
            raise ServiceError(StatusCodes.BadSecurityChecksFailed)
        for one in _given(key_format, key) if key else (self._next_key, self.own.private_key):
            if one and one.public_key() == certificate.public_key():
                self.pending = OwnCertificate(certificate, one)
                return
        raise ServiceError(StatusCodes.BadSecurityChecksFailed)

    def applied(self) -> OwnCertificate:
        """The pending one, which is in use from here on. Raises ServiceError where there is none."""
        if self.pending is None:
            raise ServiceError(StatusCodes.BadNothingToDo)
        self.own, self.pending, self._next_key = self.pending, None, None
        return self.own


def _name(subject: str) -> x509.Name:
    """``CN=name/O=organization`` as Part 12 writes it, or with commas (RFC 4514)."""
    parts = subject if "/" not in subject else ",".join(part for part in subject.split("/") if part)
    try:
        return x509.Name.from_rfc4514_string(parts)
    except ValueError:
        raise ServiceError(StatusCodes.BadInvalidArgument) from None


def _has_issued(issuer: x509.Certificate, certificate: x509.Certificate) -> bool:
    try:
        certificate.verify_directly_issued_by(issuer)
    except (InvalidSignature, *MALFORMED):
        return False
    return True


def _given(key_format: str, content: bytes) -> tuple[RSAPrivateKey, ...]:
    if key_format != PEM:
        raise ServiceError(StatusCodes.BadNotSupported)
    try:
        key = load_pem_private_key(content, password=None)
    except MALFORMED:
        raise ServiceError(StatusCodes.BadInvalidArgument) from None
    return (key,) if isinstance(key, RSAPrivateKey) else ()
