"""Users of the site file and their roles, and the endpoints by which they may connect."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any, Final

from bridge.base import clock
from bridge.base.sources import source_of
from bridge.command.messages.request import Identity, Role, Source
from bridge.config import OpcUaTable
from bridge.northbound.logins import PasswordChecks
from bridge.northbound.opcua.certificates.client_trust import utc_now
from bridge.northbound.opcua.certificates.user_certificates import judge_user, user_certificates
from bridge.northbound.opcua.failed_logins import FailedLogins
from bridge.northbound.passwords import ANONYMOUS, check_users
from bridge.trust import TrustLists
from bridge.trust.chain import named
from bridge.trust.files import der
from bridge.uaserver.application import LoginAttempt
from bridge.uaserver.client_notices import tell
from bridge.uaserver.connections.security import read_password, read_user_certificate
from bridge.uaserver.library import ObjectIds, ServiceError, StatusCodes, get, node_id, ua

_LONGEST_NAME: Final = 64
_LONGEST_PASSWORD: Final = 1024


def security_policies(settings: OpcUaTable) -> list[ua.SecurityPolicyType]:
    """The endpoints to offer; the first is also the one that passwords on an open channel are
    encrypted by, and the one every client knows. Signing alone is not offered: passwords and commands
    would cross the network for everyone to read."""
    policies = [
        ua.SecurityPolicyType.Basic256Sha256_SignAndEncrypt,
        ua.SecurityPolicyType.Aes128Sha256RsaOaep_SignAndEncrypt,
        ua.SecurityPolicyType.Aes256Sha256RsaPss_SignAndEncrypt,
    ]
    if settings.no_security:
        policies.append(ua.SecurityPolicyType.NoSecurity)
    return policies


class Accounts:
    """The users of the site file, with passwords or certificates; ``lists`` gives who is trusted at present,
    for the issuers of these."""

    def __init__(
        self,
        settings: OpcUaTable,
        lists: Callable[[], TrustLists] = TrustLists,
        sleep: Callable[[float], Any] = asyncio.sleep,
    ) -> None:
        check_users(settings.user)
        self._accounts = {user.name: user for user in settings.user}
        self._of_certificates = user_certificates(settings)
        self._lists = lists
        self._anonymous = Role.named(settings.anonymous)
        self._checks = PasswordChecks()
        self._failed = FailedLogins()
        self._sleep = sleep

    def close(self) -> None:
        self._checks.close()

    @property
    def highest_role(self) -> Role:
        """Highest role that anybody has."""
        roles = [Role[user.role.upper()] for user in self._accounts.values()]
        return max([*roles, self._anonymous or Role.OBSERVER])

    @property
    def tokens(self) -> list[type]:
        """Identity tokens to offer. With neither users nor anonymous access, the list is empty and nobody
        gets in."""
        has_passwords = any(user.password_hash for user in self._accounts.values())
        tokens: list[type] = [ua.UserNameIdentityToken] if has_passwords else []
        if self._of_certificates:
            tokens.append(ua.X509IdentityToken)
        if self._anonymous is not None:
            tokens.append(ua.AnonymousIdentityToken)
        return tokens or [ua.UserNameIdentityToken]

    async def identify(self, login: LoginAttempt) -> Identity:
        """Identity that an identity token stands for. Raises ServiceError, after a while where many have
        failed."""
        try:
            return await self._identify(login)
        except ServiceError:
            await self._sleep(self._failed.delay_s(source_of(login.address), clock.now()))
            raise

    async def _identify(self, login: LoginAttempt) -> Identity:
        token, address = login.token, login.address
        if isinstance(token, ua.UserNameIdentityToken):
            password = read_password(token, login.nonce, login.key, encrypted=login.encrypted)
            return await self.login(get(token, "UserName") or "", password, address)
        if isinstance(token, ua.X509IdentityToken):
            return self._by_certificate(login)
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

    def _by_certificate(self, login: LoginAttempt) -> Identity:
        source = source_of(login.address)
        signed = login.certificate + login.nonce
        try:
            certificate = read_user_certificate(login.token, login.signature, signed)
        except ServiceError:
            tell("refused logins", source, "a user's certificate without its signature")
            raise
        account = self._of_certificates.get(der(certificate))
        verdict = judge_user(certificate, self._lists(), utc_now()) if account else None
        if account is None or verdict is None or verdict.fault:
            tell(
                "refused logins", source, f"{named(certificate)}: {verdict or 'no user has this certificate'}"
            )
            raise ServiceError(StatusCodes.BadIdentityTokenRejected)
        return Identity(Source.OPCUA, account.name, Role[account.role.upper()], login.address)

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
        return Identity(Source.OPCUA, name, Role[account.role.upper()], address)
