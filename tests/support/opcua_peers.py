"""Client applications with certificates of their own, and users of a server that lets nobody in without."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from hashlib import sha1
from pathlib import Path

from asyncua import Client, ua
from asyncua.crypto import security_policies
from asyncua.crypto.cert_gen import (
    dump_private_key_as_pem,
    generate_private_key,
    generate_self_signed_app_certificate,
)
from asyncua.crypto.uacrypto import CertProperties
from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding
from cryptography.x509.oid import ExtendedKeyUsageOID

from bridge.config import UserTable
from bridge.northbound.opcua.server import OpcUaServer
from bridge.northbound.passwords import hash_password
from tests.support.opcua_site import LocalView

PASSWORD = "swordfish"
POLICIES = [
    security_policies.SecurityPolicyBasic256Sha256,
    security_policies.SecurityPolicyAes128Sha256RsaOaep,
    security_policies.SecurityPolicyAes256Sha256RsaPss,
]
Served = tuple[OpcUaServer, LocalView]


@dataclass(frozen=True)
class Peer:
    """A client application with its own certificate."""

    certificate: bytes
    key: bytes
    uri: str = ""

    def trusted_in(self, state_dir: Path) -> Path:
        """Put its certificate where the service looks for those that it trusts; the file."""
        file = state_dir / "certificates" / "trusted" / f"{sha1(self.certificate).hexdigest()}.der"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(self.certificate)
        return file

    async def secure(self, client: Client, policy: type = POLICIES[0], **more: object) -> None:
        certificate, key = CertProperties(self.certificate, "der"), CertProperties(self.key, "pem")
        client.application_uri = self.uri
        await client.set_security(policy, certificate, key, **more)


def make_peer(name: str) -> Peer:
    key = generate_private_key()
    names: list[x509.GeneralName] = [x509.UniformResourceIdentifier(f"urn:{name}"), x509.DNSName(name)]
    made = generate_self_signed_app_certificate(key, name, {}, names, [ExtendedKeyUsageOID.CLIENT_AUTH])
    return Peer(made.public_bytes(Encoding.DER), dump_private_key_as_pem(key), f"urn:{name}")


def make_users() -> list[UserTable]:
    """anna may command, otto may read."""
    line = hash_password(PASSWORD)
    return [
        UserTable(name="anna", role="operator", password_hash=line),
        UserTable(name="otto", role="observer", password_hash=line),
    ]


@asynccontextmanager
async def logged_in(
    served: Served, peer: Peer | None, user: str = "", password: str = "", policy: type = POLICIES[0]
) -> AsyncIterator[Client]:
    client = Client(served[0].endpoint_url, timeout=10)
    if peer:
        await peer.secure(client, policy)
    if user:
        client.set_user(user)
        client.set_password(password)
    async with client:
        yield client


async def channel_of(served: Served, peer: Peer, owner: Client) -> Client:
    """Another channel of ``peer`` with the token of the owner's session."""
    client = Client(served[0].endpoint_url, timeout=10)
    await peer.secure(client)
    await client.connect_socket()
    await client.send_hello()
    await client.open_secure_channel()
    client.uaclient.session.restore_authentication_token(owner.uaclient.protocol.authentication_token)
    client._server_nonce = owner._server_nonce
    return client


def signed_in(client: Client, user: str) -> ua.ActivateSessionParameters:
    """The channel is encrypted, so that the password need not be."""
    made = ua.ActivateSessionParameters()
    made.UserIdentityToken = ua.UserNameIdentityToken(UserName=user, Password=PASSWORD.encode())
    challenge = client.security_policy.peer_certificate + client._server_nonce
    made.ClientSignature.Algorithm = POLICIES[0].AsymmetricSignatureURI
    made.ClientSignature.Signature = client.security_policy.asymmetric_cryptography.signature(challenge)
    return made
