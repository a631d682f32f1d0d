"""ServerConfiguration: certificates and trust, managed by a client (push, OPC 10000-12 §7.10).

For administrators on an encrypted channel alone. What is renewed counts for new channels; no session ends.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from asyncua.server.address_space import AddressSpace, AttributeValue
from cryptography import x509

from bridge.base import clock
from bridge.base.errors import OperationFailed
from bridge.command.messages.request import Identity, Role
from bridge.northbound.opcua.certificates.client_trust import utc_now
from bridge.northbound.opcua.certificates.own_certificate import OwnCertificate
from bridge.northbound.opcua.certificates.own_files import put_pair
from bridge.northbound.opcua.certificates.own_renewal import PEM, OwnRenewal
from bridge.northbound.opcua.certificates.trust_list_files import (
    MOST_BYTES,
    TrustListContents,
    TrustListFiles,
    decoded,
    encoded,
)
from bridge.northbound.opcua.space.permissions import role_permissions
from bridge.trust import TrustStore
from bridge.trust.files import MALFORMED, der, thumbprint
from bridge.trust.store import MOST_FILES
from bridge.uaserver.library import (
    AttributeIds,
    ObjectIds,
    ServiceError,
    StatusCodes,
    data_value,
    get,
    make,
    node_id,
    status,
    ua,
    variant,
)

_log = logging.getLogger(__name__)

_Type = ua.VariantType
_GROUP: Final = "ServerConfiguration_CertificateGroups_DefaultApplicationGroup"
_LIST: Final = f"{_GROUP}_TrustList"
_ALL: Final = 15
_READ: Final = 1
_RSA: Final = ObjectIds.RsaSha256ApplicationCertificateType
_ENCRYPTED: Final = 3
"""AccessRestrictionType: signing and encryption are required (Part 3 §8.56)."""


@dataclass(frozen=True, slots=True)
class _Method:
    """``arguments`` are the types of the input, ``output`` is that of the result."""

    act: Callable[..., Any]
    arguments: tuple[ua.VariantType, ...] = ()
    output: ua.VariantType | None = None


@dataclass(frozen=True, slots=True)
class _Caller:
    """Session that calls, and who it is."""

    session: str
    name: str


class ServerConfiguration:
    """Methods on ``renewal`` and ``store``. ``renew`` has a certificate used that was put into ``folder``,
    which is None where the site file names the certificate: it is not ours to replace then."""

    def __init__(
        self,
        renewal: OwnRenewal,
        store: TrustStore,
        folder: Path | None,
        renew: Callable[[OwnCertificate], None],
    ) -> None:
        self._renewal = renewal
        self._store = store
        self._folder = folder
        self._renew = renew
        self._files = TrustListFiles()
        # One after the other: each may take a moment in a thread.
        self._turn = asyncio.Lock()
        self._leaving: set[asyncio.Task[None]] = set()

    def has(self, where: ua.NodeId) -> bool:
        """True for one of its methods."""
        return where in METHODS

    async def call(
        self, who: Identity, call: ua.CallMethodRequest, *, encrypted: bool
    ) -> ua.CallMethodResult:
        method = METHODS[get(call, "MethodId")]
        given: list[ua.Variant] = get(call, "InputArguments") or []
        code = _refusal(who, call, len(given), encrypted=encrypted)
        if code is not None:
            return make(ua.CallMethodResult, StatusCode=status(code))
        faults = [
            status(StatusCodes.Good if one.VariantType is kind else StatusCodes.BadTypeMismatch)
            for one, kind in zip(given, method.arguments, strict=True)
        ]
        if not all(one.is_good() for one in faults):
            return make(
                ua.CallMethodResult,
                StatusCode=status(StatusCodes.BadInvalidArgument),
                InputArgumentResults=faults,
            )
        try:
            caller = _Caller(who.connection, who.user)
            async with self._turn:
                result = await asyncio.to_thread(
                    method.act, self, caller, *(get(one, "Value") for one in given)
                )
                # In the event loop: it is the server's.
                if isinstance(result, OwnCertificate):
                    self._renew(result)
        except ServiceError as error:
            return make(ua.CallMethodResult, StatusCode=status(int(error.code)))
        except (OSError, OperationFailed) as error:
            _log.warning("OPC UA: ServerConfiguration: %s", error)
            return make(ua.CallMethodResult, StatusCode=status(StatusCodes.BadResourceUnavailable))
        output = [variant(result, method.output)] if method.output is not None else []
        return make(ua.CallMethodResult, InputArgumentResults=faults, OutputArguments=output)

    def leave(self, session: str) -> None:
        """The session has ended, or its connection has."""
        task = asyncio.get_running_loop().create_task(self._leave(session))
        self._leaving.add(task)
        task.add_done_callback(self._leaving.discard)

    async def _leave(self, session: str) -> None:
        async with self._turn:
            self._files.leave(session)

    # the certificate; all below run in a thread, one at a time

    def create_signing_request(
        self, _: _Caller, group: ua.NodeId, kind: ua.NodeId, subject: str, new_key: bool, nonce: bytes
    ) -> bytes:
        self._check_group(group, kind)
        return self._renewal.request(subject or "", nonce or b"", new_key=new_key)

    def update_certificate(
        self,
        caller: _Caller,
        group: ua.NodeId,
        kind: ua.NodeId,
        certificate: bytes,
        issuers: list[bytes] | None,
        key_format: str | None,
        key: bytes | None,
    ) -> bool:
        """True: what has come has to be applied."""
        self._check_group(group, kind)
        self._renewal.update(certificate or b"", issuers or [], key_format or "", key or b"", utc_now())
        _log.info("OPC UA: %s has sent another certificate for the server", caller.name)
        return True

    def apply_changes(self, caller: _Caller) -> OwnCertificate:
        assert self._folder is not None, "checked when it came"
        if self._renewal.pending is None:
            raise ServiceError(StatusCodes.BadNothingToDo)
        put_pair(self._folder, self._renewal.pending)
        own = self._renewal.applied()
        _log.info("OPC UA: %s has had it applied: SHA-1 %s", caller.name, thumbprint(own.certificate))
        return own

    def rejected(self, _: _Caller) -> list[bytes]:
        return [der(one.certificate) for one in self._store.rejected_ones()]

    def _check_group(self, group: ua.NodeId, kind: ua.NodeId) -> None:
        """Raises ServiceError for what is not the one certificate that there is, or is not ours."""
        groups = (node_id(ObjectIds.Null), node_id(get(ObjectIds, _GROUP)))
        if group not in groups or kind not in (node_id(ObjectIds.Null), node_id(_RSA)):
            raise ServiceError(StatusCodes.BadInvalidArgument)
        if self._folder is None:
            raise ServiceError(StatusCodes.BadNotWritable)

    # the trust list

    def open(self, caller: _Caller, mode: int) -> int:
        content = encoded(self._lists(), _ALL) if mode == _READ else b""
        return self._files.open(caller.session, mode, content, clock.now())

    def open_with_masks(self, caller: _Caller, masks: int) -> int:
        return self._files.open(caller.session, _READ, encoded(self._lists(), masks), clock.now())

    def close(self, caller: _Caller, handle: int) -> None:
        self._files.close(caller.session, handle, clock.now())

    def read(self, caller: _Caller, handle: int, length: int) -> bytes:
        return self._files.read(caller.session, handle, length, clock.now())

    def write(self, caller: _Caller, handle: int, data: bytes | None) -> None:
        self._files.write(caller.session, handle, data or b"", clock.now())

    def position(self, caller: _Caller, handle: int) -> int:
        return self._files.position(caller.session, handle, clock.now())

    def seek(self, caller: _Caller, handle: int, position: int) -> None:
        self._files.seek(caller.session, handle, position, clock.now())

    def close_and_update(self, caller: _Caller, handle: int) -> bool:
        """False: what has come counts already."""
        content = self._files.close(caller.session, handle, clock.now())
        if content is None:
            raise ServiceError(StatusCodes.BadInvalidState)
        lists = decoded(content)
        store = self._store
        for folder, certificates, crls in (
            (store.trusted, lists.trusted, lists.trusted_crls),
            (store.issuers, lists.issuers, lists.issuer_crls),
        ):
            if certificates is not None:
                store.replace(folder, x509.Certificate, certificates)
            if crls is not None:
                store.replace(folder, x509.CertificateRevocationList, crls)
        _log.info("OPC UA: %s has replaced the trust list", caller.name)
        return False

    def add_certificate(self, caller: _Caller, content: bytes | None, is_trusted: bool) -> None:
        self._check_unwritten()
        try:
            certificate = x509.load_der_x509_certificate(content or b"")
        except MALFORMED:
            raise ServiceError(StatusCodes.BadCertificateInvalid) from None
        folder = self._store.trusted if is_trusted else self._store.issuers
        if len(self._store.files(folder)) >= MOST_FILES:
            raise ServiceError(StatusCodes.BadResourceUnavailable)
        if is_trusted:
            self._store.trust(certificate)
        else:
            self._store.add(folder, certificate)
        _log.info("OPC UA: %s has added %s to the trust list", caller.name, thumbprint(certificate))

    def remove_certificate(self, caller: _Caller, print_: str | None, is_trusted: bool) -> None:
        self._check_unwritten()
        folder = self._store.trusted if is_trusted else self._store.issuers
        wanted = (print_ or "").lower()
        found = [
            file
            for file, one in self._store.files(folder)
            if isinstance(one, x509.Certificate) and thumbprint(one) == wanted
        ]
        if not found:
            raise ServiceError(StatusCodes.BadInvalidArgument)
        for file in found:
            file.unlink(missing_ok=True)
        _log.info("OPC UA: %s has removed %s from the trust list", caller.name, wanted)

    def _check_unwritten(self) -> None:
        self._files.drop_idle(clock.now())
        if self._files.is_written:
            raise ServiceError(StatusCodes.BadInvalidState)

    def _lists(self) -> TrustListContents:
        certificate, crl = x509.Certificate, x509.CertificateRevocationList
        trusted = [one for _, one in self._store.files(self._store.trusted)]
        issuers = [one for _, one in self._store.files(self._store.issuers)]
        return TrustListContents(
            tuple(one for one in trusted if isinstance(one, certificate)),
            tuple(one for one in trusted if isinstance(one, crl)),
            tuple(one for one in issuers if isinstance(one, certificate)),
            tuple(one for one in issuers if isinstance(one, crl)),
        )


_Methods = ServerConfiguration
_BY_NAME: Final[Mapping[str, _Method]] = {
    "ServerConfiguration_CreateSigningRequest": _Method(
        _Methods.create_signing_request,
        (_Type.NodeId, _Type.NodeId, _Type.String, _Type.Boolean, _Type.ByteString),
        _Type.ByteString,
    ),
    "ServerConfiguration_UpdateCertificate": _Method(
        _Methods.update_certificate,
        (_Type.NodeId, _Type.NodeId, _Type.ByteString, _Type.ByteString, _Type.String, _Type.ByteString),
        _Type.Boolean,
    ),
    "ServerConfiguration_ApplyChanges": _Method(_Methods.apply_changes),
    "ServerConfiguration_GetRejectedList": _Method(_Methods.rejected, (), _Type.ByteString),
    f"{_LIST}_Open": _Method(_Methods.open, (_Type.Byte,), _Type.UInt32),
    f"{_LIST}_OpenWithMasks": _Method(_Methods.open_with_masks, (_Type.UInt32,), _Type.UInt32),
    f"{_LIST}_Close": _Method(_Methods.close, (_Type.UInt32,)),
    f"{_LIST}_Read": _Method(_Methods.read, (_Type.UInt32, _Type.Int32), _Type.ByteString),
    f"{_LIST}_Write": _Method(_Methods.write, (_Type.UInt32, _Type.ByteString)),
    f"{_LIST}_GetPosition": _Method(_Methods.position, (_Type.UInt32,), _Type.UInt64),
    f"{_LIST}_SetPosition": _Method(_Methods.seek, (_Type.UInt32, _Type.UInt64)),
    f"{_LIST}_CloseAndUpdate": _Method(_Methods.close_and_update, (_Type.UInt32,), _Type.Boolean),
    f"{_LIST}_AddCertificate": _Method(_Methods.add_certificate, (_Type.ByteString, _Type.Boolean)),
    f"{_LIST}_RemoveCertificate": _Method(_Methods.remove_certificate, (_Type.String, _Type.Boolean)),
}
METHODS: Final[Mapping[ua.NodeId, _Method]] = {
    node_id(get(ObjectIds, name)): method for name, method in _BY_NAME.items()
}
_OWNERS: Final[Mapping[ua.NodeId, ua.NodeId]] = {
    node_id(get(ObjectIds, name)): node_id(get(ObjectIds, name.rpartition("_")[0])) for name in _BY_NAME
}
"""Objects that have the methods."""
_VALUES: Final[Mapping[str, ua.Variant]] = {
    "ServerConfiguration_SupportedPrivateKeyFormats": variant([PEM], _Type.String),
    "ServerConfiguration_MaxTrustListSize": variant(MOST_BYTES, _Type.UInt32),
    "ServerConfiguration_MulticastDnsEnabled": variant(False, _Type.Boolean),
    f"{_GROUP}_CertificateTypes": variant([node_id(_RSA)], _Type.NodeId),
    f"{_LIST}_Writable": variant(True, _Type.Boolean),
    f"{_LIST}_UserWritable": variant(True, _Type.Boolean),
}


def _refusal(who: Identity, call: ua.CallMethodRequest, given: int, *, encrypted: bool) -> int | None:
    """Code for a call that is not carried out, whatever its arguments are."""
    if who.role < Role.ADMIN:
        return StatusCodes.BadUserAccessDenied
    if not encrypted:
        return StatusCodes.BadSecurityModeInsufficient
    where = get(call, "MethodId")
    if get(call, "ObjectId") != _OWNERS[where]:
        return StatusCodes.BadMethodInvalid
    wanted = len(METHODS[where].arguments)
    if given != wanted:
        return StatusCodes.BadArgumentsMissing if given < wanted else StatusCodes.BadTooManyArguments
    return None


def describe(space: AddressSpace) -> None:
    """Give the nodes of asyncua's in ``space`` the values that are true, and say who may call the methods."""
    for name, value in _VALUES.items():
        attributes = space[node_id(get(ObjectIds, name))].attributes
        attributes[AttributeIds.Value] = AttributeValue(data_value(value))
    table = role_permissions(Role.ADMIN, ua.PermissionType.Call, sends_events=False)
    restricted = AttributeValue(data_value(variant(_ENCRYPTED, _Type.UInt16)))
    for where in METHODS:
        space[where].attributes |= {
            AttributeIds.RolePermissions: table,
            AttributeIds.UserRolePermissions: table,
            AttributeIds.AccessRestrictions: restricted,
        }
