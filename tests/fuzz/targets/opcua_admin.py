"""An administrator on an encrypted channel: the only one whom the methods of ServerConfiguration let further
than the door."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Final

from asyncua import ua
from asyncua.crypto.security_policies import SecurityPolicyBasic256Sha256
from cryptography import x509
from cryptography.hazmat.primitives.serialization import load_pem_private_key

from tests.fuzz.rig import ADMIN, PASSWORD, Rig
from tests.fuzz.targets.opcua_channel import HANDLE, OTHER_HANDLE, Channel
from tests.support.opcua_peers import Peer, make_peer

_LIST: Final = "ServerConfiguration_CertificateGroups_DefaultApplicationGroup_TrustList"
_READ, _WRITE = 1, 6


@cache
def _peer() -> Peer:
    return make_peer("fuzz")


def _policy(own: Path) -> SecurityPolicyBasic256Sha256:
    """``own`` is the bridge's certificate, which administrators change."""
    certificate = x509.load_der_x509_certificate(_peer().certificate)
    key = load_pem_private_key(_peer().key, None)
    mode = ua.MessageSecurityMode.SignAndEncrypt
    return SecurityPolicyBasic256Sha256(own.read_bytes(), certificate, key, mode)


class AdminChannel(Channel):
    """The same as ``Channel``; ``send`` is not for it, whose chunks are encrypted. ``writes`` has it write a
    trust list, which is in the way of all else that is done to that; else it reads one."""

    def __init__(self, rig: Rig, *, writes: bool = False) -> None:
        policy = _policy(rig.folder / "state" / "certificates" / "own" / "own_certificate.der")
        super().__init__(rig.opcua, policy)
        self._file = (OTHER_HANDLE, _WRITE) if writes else (HANDLE, _READ)
        self._ids = 1000

    def _describe(self, create: ua.CreateSessionParameters) -> None:
        create.ClientDescription.ApplicationUri = _peer().uri
        create.ClientNonce = bytes(32)
        create.ClientCertificate = _peer().certificate

    def _identify(self, made: ua.CreateSessionResult, activate: ua.ActivateSessionParameters) -> None:
        """The channel is encrypted, so that the password need not be."""
        activate.UserIdentityToken = ua.UserNameIdentityToken(UserName=ADMIN, Password=PASSWORD.encode())
        challenge = made.ServerCertificate + made.ServerNonce
        activate.ClientSignature.Algorithm = self._policy.AsymmetricSignatureURI
        activate.ClientSignature.Signature = self._policy.asymmetric_cryptography.signature(challenge)

    def _prepare(self) -> None:
        where, method = (ua.NodeId(getattr(ua.ObjectIds, name)) for name in (_LIST, f"{_LIST}_Open"))
        marker, mode = self._file
        self._open_file(marker, where, method, mode)

    def send_body(self, body: bytes) -> None:
        self._ids += 1
        kind = ua.MessageType.SecureMessage
        self.socket.sendall(self._connection.message_to_binary(self._with_known(body), kind, self._ids))
