"""Who may come in: endpoint policy, trust in channels, users and their roles."""

from __future__ import annotations

import struct
from dataclasses import dataclass, replace
from typing import Any, Final, NoReturn

from asyncua.common.connection import SecureConnection
from cryptography.hazmat.primitives.asymmetric.padding import MGF1, OAEP
from cryptography.hazmat.primitives.asymmetric.rsa import RSAPrivateKey
from cryptography.hazmat.primitives.hashes import SHA1, SHA256

from bridge.command.messages.request import Identity, Role, Source
from bridge.config import OpcUaTable
from bridge.northbound.logins import PasswordChecks
from bridge.northbound.opcua.certificates import TrustedCertificates, fingerprint
from bridge.northbound.opcua.library import (
    ObjectIds,
    ServiceError,
    StatusCodes,
    first_certificate,
    get,
    node_id,
    ua,
)
from bridge.northbound.opcua.notices import tell
from bridge.northbound.passwords import ANONYMOUS, check_users
from bridge.northbound.sources import source_of

_LONGEST_NAME: Final = 64
_LONGEST_PASSWORD: Final = 1024
_MOST_BLOCKS: Final = 8
"""A password of that length, encrypted, with room for the nonce."""


def security_policies(settings: OpcUaTable) -> list[ua.SecurityPolicyType]:
    """The endpoints to offer; the first is also the one that passwords on an open channel are
    encrypted by, and the one every client knows. Signing alone is not offered: passwords and commands
    would cross the network for everyone to read."""
    policies = [
        ua.SecurityPolicyType.Basic256Sha256_SignAndEncrypt,
        ua.SecurityPolicyType.Aes256Sha256RsaPss_SignAndEncrypt,
    ]
    if settings.no_security:
        policies.append(ua.SecurityPolicyType.NoSecurity)
    return policies


@dataclass(frozen=True, slots=True)
class CheckedPolicy:
    """A security policy of asyncua that opens no channel to a certificate without trust.

    asyncua looks at the certificate in CreateSession, which anyone can copy; here it is the one
    whose key the client proves to have.
    """

    _policy: Any
    _trusted: TrustedCertificates | None
    _source: str = ""

    def of(self, source: str) -> CheckedPolicy:
        """The same for connections of ``source``. What the log counts by must not be made up by a client."""
        return replace(self, _source=source)

    def matches(self, uri: str, mode: ua.MessageSecurityMode | None = None) -> bool:
        return self._policy.matches(uri, mode)

    def create(self, peer_certificate: bytes | None) -> Any:
        """Raises ServiceError for a certificate that is missing, unreadable or not trusted."""
        if self._policy.mode is not ua.MessageSecurityMode.None_:
            self._check(peer_certificate)
        return self._policy.create(peer_certificate)

    def _check(self, content: bytes | None) -> None:
        try:
            certificate = first_certificate(content)
        except (ValueError, IndexError):
            certificate = None
        if certificate is None:
            raise ServiceError(StatusCodes.BadCertificateInvalid)
        why = self._trusted.refusal(certificate) if self._trusted else None
        if why:
            name = certificate.subject.rfc4514_string()
            whose = f"SHA-256 {fingerprint(certificate)}, {name[:_LONGEST_NAME]}"
            tell("refused certificates", self._source, f"{whose}: {why}")
            # Part 4 §6.1.3: the client is not told more than this.
            raise ServiceError(StatusCodes.BadSecurityChecksFailed)


_NO_SECURITY: Final = "http://opcfoundation.org/UA/SecurityPolicy#None"


class Channel(SecureConnection):
    """asyncua's, which takes a policy or a mode that is not offered for a malformed message.

    ``source`` is whom the log counts it for.
    """

    source: str = ""

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

    def _offers(self, uri: str, mode: ua.MessageSecurityMode | None = None) -> bool:
        return any(policy.matches(uri, mode) for policy in self._policies)

    def _refuse(self, what: str, code: int) -> NoReturn:
        tell("refused channels", self.source, f"{what} is not offered")
        raise ServiceError(code)


_OAEP: Final = {
    "http://www.w3.org/2001/04/xmlenc#rsa-oaep": SHA1,
    "http://opcfoundation.org/UA/security/rsa-oaep-sha2-256": SHA256,
}
"""How a password may be encrypted. RSA 1.5 is not among them: its padding tells on the key's owner."""

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


def _decrypt(content: bytes, key: RSAPrivateKey, digest: SHA1 | SHA256) -> bytes:
    size = key.key_size // 8
    scheme = OAEP(mgf=MGF1(digest), algorithm=digest, label=None)
    try:
        blocks = [content[at : at + size] for at in range(0, len(content), size)]
        return b"".join(key.decrypt(block, scheme) for block in blocks[:_MOST_BLOCKS])
    except ValueError:
        raise ServiceError(StatusCodes.BadIdentityTokenInvalid) from None


_ROLES: Final = {"observer": Role.OBSERVER, "operator": Role.OPERATOR, "engineer": Role.ENGINEER}


class Users:
    """The users of the site file. Nobody is an administrator: the address space is the site's."""

    def __init__(self, settings: OpcUaTable) -> None:
        check_users(settings.user)
        self._accounts = {user.name: user for user in settings.user}
        self._anonymous = _ROLES.get(settings.anonymous)
        self._checks = PasswordChecks()

    def close(self) -> None:
        self._checks.close()

    @property
    def tokens(self) -> list[type]:
        """The kinds of identity tokens to offer. Without users and anonymous, nobody gets in."""
        tokens: list[type] = [ua.UserNameIdentityToken] if self._accounts else []
        if self._anonymous is not None:
            tokens.append(ua.AnonymousIdentityToken)
        return tokens or [ua.UserNameIdentityToken]

    async def identify(
        self, token: object, nonce: bytes, key: RSAPrivateKey, address: str, *, encrypted: bool
    ) -> Identity:
        """Whose identity token this is; ``nonce``, ``key`` and ``encrypted`` as for ``read_password``. Raises
        ServiceError."""
        if isinstance(token, ua.UserNameIdentityToken):
            password = read_password(token, nonce, key, encrypted=encrypted)
            return await self.login(get(token, "UserName") or "", password, address)
        is_null = isinstance(token, ua.ExtensionObject) and token.TypeId == node_id(ObjectIds.Null)
        if is_null or isinstance(token, ua.AnonymousIdentityToken):
            return self.anonymous(address)
        raise ServiceError(StatusCodes.BadIdentityTokenRejected)

    def anonymous(self, address: str) -> Identity:
        """Raises ServiceError where the site file wants everyone to have a name."""
        if self._anonymous is None:
            raise ServiceError(StatusCodes.BadIdentityTokenRejected)
        return Identity(Source.OPCUA, ANONYMOUS, self._anonymous, address)

    async def login(self, name: str, password: str, address: str) -> Identity:
        """Raises ServiceError where name and password do not belong together."""
        account = self._accounts.get(name)
        known = account.password_hash if account else None
        is_right = len(password) <= _LONGEST_PASSWORD and await self._checks.is_right(
            known, password, source_of(address)
        )
        if account is None or not is_right:
            tell("refused logins", source_of(address), f"user {name[:_LONGEST_NAME]!r}")
            raise ServiceError(StatusCodes.BadUserAccessDenied)
        return Identity(Source.OPCUA, name, _ROLES[account.role], address)
