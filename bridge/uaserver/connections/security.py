"""Trust in channels, and passwords that come through them."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, NoReturn, Protocol

from asyncua.common.connection import SecureConnection
from cryptography import x509
from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm
from cryptography.hazmat.primitives.asymmetric.padding import MGF1, OAEP, PSS, PKCS1v15
from cryptography.hazmat.primitives.asymmetric.rsa import RSAPrivateKey, RSAPublicKey
from cryptography.hazmat.primitives.hashes import SHA1, SHA256

from bridge.uaserver.client_notices import tell
from bridge.uaserver.library import (
    ServiceError,
    StatusCodes,
    change,
    first_certificate,
    get,
    ua,
)

_LONGEST_NAME: Final = 64
_MOST_BLOCKS: Final = 8
"""The longest password that is read, encrypted, with room for the nonce."""
_TOKEN_TYPES: Final[Mapping[type, ua.UserTokenType]] = {
    ua.AnonymousIdentityToken: ua.UserTokenType.Anonymous,
    ua.UserNameIdentityToken: ua.UserTokenType.UserName,
    ua.X509IdentityToken: ua.UserTokenType.Certificate,
}


@dataclass(frozen=True, slots=True)
class Refused:
    """Refused of a certificate: the status code for the client, and ``why`` for the log."""

    code: int
    why: str


class Trust(Protocol):
    """Judge of the certificates that clients show."""

    def refusal(self, sent: bytes, source: str, application_uri: str | None = None) -> Refused | None:
        """None for a client that is trusted. ``sent`` is its certificate in DER, and any issuers behind it,
        ``source`` its address; ``application_uri`` is what it says to be, where it has said so yet."""
        ...


@dataclass(frozen=True, slots=True)
class CheckedPolicy:
    """A security policy of asyncua that opens no channel to a certificate without trust.

    asyncua looks at the certificate in CreateSession, which anyone can copy; here it is the one
    whose key the client proves to have.
    """

    _policy: Any
    _trusted: Trust
    _source: str = ""

    def of(self, source: str) -> CheckedPolicy:
        """The same for connections of ``source``. What the log counts by must not be made up by a client."""
        return replace(self, _source=source)

    def matches(self, uri: str, mode: ua.MessageSecurityMode | None = None) -> bool:
        return self._policy.matches(uri, mode)

    def create(self, peer_certificate: bytes | None) -> Any:
        """Raises ServiceError for a certificate that is missing, unreadable or not trusted."""
        if self._policy.mode is not ua.MessageSecurityMode.None_:
            self.check(peer_certificate)
        return self._policy.create(peer_certificate)

    def check(self, sent: bytes | None, application_uri: str | None = None) -> None:
        """Raises ServiceError as ``create`` does; ``sent`` and ``application_uri`` are those of
        ``Trust.refusal``."""
        if not sent:
            raise ServiceError(StatusCodes.BadCertificateInvalid)
        refusal = self._trusted.refusal(sent, self._source, application_uri)
        if refusal:
            tell("refused certificates", self._source, refusal.why)
            raise ServiceError(refusal.code)


_NO_SECURITY: Final = "http://opcfoundation.org/UA/SecurityPolicy#None"


class SecureChannel(SecureConnection):
    """asyncua's, which takes a policy or a mode that is not offered for a malformed message.

    ``source`` is whom the log counts it for.
    """

    source: str = ""
    _shown: bytes | None = None
    """Certificate of the client, in DER, and any issuers behind it."""

    def judge_again(self, application_uri: str | None = None) -> None:
        """Raises ServiceError for a client that is not trusted any more, or is not the application that it
        says to be."""
        mode = self.security_policy.Mode
        if mode is ua.MessageSecurityMode.None_:
            return
        policy = next(one for one in self._policies if one.matches(self.security_policy.URI, mode))
        policy.check(self._shown, application_uri)

    def select_policy(
        self, uri: str, peer_certificate: bytes | None, mode: ua.MessageSecurityMode | None = None
    ) -> None:
        """Raises ServiceError. Without security there is always a channel, if only to ask for endpoints."""
        is_open = uri == _NO_SECURITY
        if not is_open and not self._offers(uri):
            self._refuse(
                f"security policy {str(uri)[:_LONGEST_NAME]!r}", StatusCodes.BadSecurityPolicyRejected
            )
        is_none = is_open and mode is ua.MessageSecurityMode.None_
        if mode is not None and not is_none and not self._offers(uri, mode):
            words = f"mode {mode.name} with {uri.rpartition('#')[2]}"
            self._refuse(words, StatusCodes.BadSecurityModeRejected)
        super().select_policy(uri, peer_certificate, mode)
        self._shown = peer_certificate

    def open(self, params: Any, server: Any) -> ua.OpenSecureChannelResult:
        """Without security there is no nonce (Part 6 §6.7.4): null, where asyncua says one of no bytes."""
        result = super().open(params, server)
        is_none = self.security_policy.Mode is ua.MessageSecurityMode.None_
        return change(result, ServerNonce=None) if is_none else result

    def _offers(self, uri: str, mode: ua.MessageSecurityMode | None = None) -> bool:
        return any(policy.matches(uri, mode) for policy in self._policies)

    def _refuse(self, what: str, code: int) -> NoReturn:
        tell("refused channels", self.source, f"{what} is not offered")
        raise ServiceError(code)


_OAEP: Final = {
    "http://www.w3.org/2001/04/xmlenc#rsa-oaep": SHA1,
    "http://opcfoundation.org/UA/security/rsa-oaep-sha2-256": SHA256,
}
"""Algorithms by which a password may be encrypted. RSA 1.5 is not among them: its padding tells on the key's
owner."""

_LENGTH: Final = struct.Struct("<I")


def read_password(token: object, nonce: bytes, key: RSAPrivateKey, *, encrypted: bool) -> str:
    """The password of a UserNameIdentityToken (Part 4 §7.40.2.2).

    ``nonce`` is the server's last one to this session: a password heard once cannot be sent again.
    ``encrypted`` says whether the channel is; in clear text it is not taken on one that is not.
    Raises ServiceError.
    """
    content: bytes = get(token, "Password") or b""
    algorithm: str | None = get(token, "EncryptionAlgorithm")
    if algorithm:
        if algorithm not in _OAEP:
            raise ServiceError(StatusCodes.BadIdentityTokenRejected)
        content = _decrypt(content, key, _OAEP[algorithm]())
        (length,) = _LENGTH.unpack_from(content.ljust(_LENGTH.size, b"\0"))
        content = content[_LENGTH.size : _LENGTH.size + length]
        if not nonce or not content.endswith(nonce):
            raise ServiceError(StatusCodes.BadIdentityTokenInvalid)
        content = content[: -len(nonce)]
    elif not encrypted:
        raise ServiceError(StatusCodes.BadIdentityTokenRejected)
    try:
        return content.decode()
    except UnicodeDecodeError:
        raise ServiceError(StatusCodes.BadIdentityTokenInvalid) from None


_SIGNATURES: Final = {
    "http://www.w3.org/2001/04/xmldsig-more#rsa-sha256": PKCS1v15(),
    "http://opcfoundation.org/UA/security/rsa-pss-sha2-256": PSS(MGF1(SHA256()), PSS.DIGEST_LENGTH),
}
"""Algorithms by which a user may sign, all with SHA-256 (Part 7 §6.6)."""


def read_user_certificate(token: object, signature: object, signed: bytes) -> x509.Certificate:
    """Certificate of an X509IdentityToken whose key its sender has (Part 4 §7.40.2.3).

    ``signed`` is the server's certificate and its last nonce to this session: a signature heard once cannot
    be sent again. Raises ServiceError.
    """
    content: bytes = get(token, "CertificateData") or b""
    try:
        certificate = first_certificate(content)
        key = certificate.public_key() if certificate else None
    except (ValueError, IndexError, TypeError, UnsupportedAlgorithm):
        key = certificate = None
    if certificate is None or not isinstance(key, RSAPublicKey):
        raise ServiceError(StatusCodes.BadIdentityTokenInvalid)
    scheme = _SIGNATURES.get(get(signature, "Algorithm") or "") if signature else None
    if scheme is None:
        raise ServiceError(StatusCodes.BadUserSignatureInvalid)
    try:
        key.verify(get(signature, "Signature") or b"", signed, scheme, SHA256())
    except (InvalidSignature, ValueError):
        raise ServiceError(StatusCodes.BadUserSignatureInvalid) from None
    return certificate


def check_policy(token: object, endpoints: Sequence[ua.EndpointDescription]) -> None:
    """Raises ServiceError for an identity token that follows another policy than those of its type which the
    endpoints have (Part 4 §7.40). One that names none is taken by its type."""
    named: str | None = getattr(token, "PolicyId", None)
    kind = _TOKEN_TYPES.get(type(token))
    policies = [one for endpoint in endpoints for one in get(endpoint, "UserIdentityTokens")]
    offered = [get(one, "PolicyId") for one in policies if get(one, "TokenType") == kind]
    if named and offered and named not in offered:
        raise ServiceError(StatusCodes.BadIdentityTokenInvalid)


def _decrypt(content: bytes, key: RSAPrivateKey, digest: SHA1 | SHA256) -> bytes:
    size = key.key_size // 8
    scheme = OAEP(mgf=MGF1(digest), algorithm=digest, label=None)
    try:
        blocks = [content[at : at + size] for at in range(0, len(content), size)]
        return b"".join(key.decrypt(block, scheme) for block in blocks[:_MOST_BLOCKS])
    except ValueError:
        raise ServiceError(StatusCodes.BadIdentityTokenInvalid) from None
