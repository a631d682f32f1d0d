"""Users of the site file and their roles, and the endpoints by which they may connect."""

from __future__ import annotations

from typing import Final

from cryptography.hazmat.primitives.asymmetric.rsa import RSAPrivateKey

from bridge.base.sources import source_of
from bridge.command.messages.request import Identity, Role, Source
from bridge.config import OpcUaTable
from bridge.northbound.logins import PasswordChecks
from bridge.northbound.passwords import ANONYMOUS, check_users
from bridge.uaserver.client_notices import tell
from bridge.uaserver.library import ObjectIds, ServiceError, StatusCodes, get, node_id, ua
from bridge.uaserver.security import read_password

_LONGEST_NAME: Final = 64
_LONGEST_PASSWORD: Final = 1024


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


_ROLES: Final = {"observer": Role.OBSERVER, "operator": Role.OPERATOR, "engineer": Role.ENGINEER}


class Accounts:
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
        """Identity tokens to offer. With neither users nor anonymous access, the list is empty and nobody
        gets in."""
        tokens: list[type] = [ua.UserNameIdentityToken] if self._accounts else []
        if self._anonymous is not None:
            tokens.append(ua.AnonymousIdentityToken)
        return tokens or [ua.UserNameIdentityToken]

    async def identify(
        self, token: object, nonce: bytes, key: RSAPrivateKey, address: str, *, encrypted: bool
    ) -> Identity:
        """Identity that an identity token stands for; ``nonce``, ``key`` and ``encrypted`` as for
        ``read_password``. Raises ServiceError."""
        if isinstance(token, ua.UserNameIdentityToken):
            password = read_password(token, nonce, key, encrypted=encrypted)
            return await self.login(get(token, "UserName") or "", password, address)
        is_null = isinstance(token, ua.ExtensionObject) and token.TypeId == node_id(ObjectIds.Null)
        if is_null or isinstance(token, ua.AnonymousIdentityToken):
            return self.anonymous(address)
        raise ServiceError(StatusCodes.BadIdentityTokenRejected)

    def anonymous(self, address: str) -> Identity:
        """Identity of an anonymous session. Raises ServiceError where the site file wants every user to have
        a name."""
        if self._anonymous is None:
            raise ServiceError(StatusCodes.BadIdentityTokenRejected)
        return Identity(Source.OPCUA, ANONYMOUS, self._anonymous, address)

    async def login(self, name: str, password: str, address: str) -> Identity:
        """Identity of the named user. Raises ServiceError where name and password do not belong together."""
        account = self._accounts.get(name)
        known = account.password_hash if account else None
        is_right = len(password) <= _LONGEST_PASSWORD and await self._checks.is_right(
            known, password, source_of(address)
        )
        if account is None or not is_right:
            tell("refused logins", source_of(address), f"user {name[:_LONGEST_NAME]!r}")
            raise ServiceError(StatusCodes.BadUserAccessDenied)
        return Identity(Source.OPCUA, name, _ROLES[account.role], address)
