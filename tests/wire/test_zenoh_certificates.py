"""A controller is the common name of its certificate."""

from __future__ import annotations

import datetime
import ipaddress
import json
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID

from bridge.command.drive_link import NodeState
from tests.support.zenoh_peer import free_port, zenoh_peer
from tests.support.zenoh_rig import TOP, rig
from tests.support.zenoh_site import READY, drive_says, node_is

Signer = tuple[x509.Name, ec.EllipticCurvePrivateKey]


def certificate(folder: Path, name: str, by: Signer | None = None) -> Signer:
    """``name.pem`` and ``name.key``, signed ``by`` an authority or, without one, an authority itself."""
    key = ec.generate_private_key(ec.SECP256R1())
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
    issuer, signing_key = by or (subject, key)
    now = datetime.datetime.now(datetime.UTC)
    made = (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - datetime.timedelta(days=1))
        .not_valid_after(now + datetime.timedelta(days=1))
        .add_extension(x509.BasicConstraints(ca=by is None, path_length=None), critical=True)
        .add_extension(
            x509.SubjectAlternativeName([x509.IPAddress(ipaddress.ip_address("127.0.0.1"))]), critical=False
        )
        .sign(signing_key, hashes.SHA256())
    )
    (folder / f"{name}.pem").write_bytes(made.public_bytes(serialization.Encoding.PEM))
    (folder / f"{name}.key").write_bytes(
        key.private_bytes(
            serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
        )
    )
    return subject, key


def listening(folder: Path, port: int) -> str:
    return (
        f"tls/127.0.0.1:{port}#enable_mtls=true;root_ca_certificate_file={folder}/authority.pem;"
        f"listen_certificate_file={folder}/bridge.pem;listen_private_key_file={folder}/bridge.key"
    )


def connecting(folder: Path, port: int, name: str) -> str:
    return (
        f"tls/127.0.0.1:{port}#enable_mtls=true;root_ca_certificate_file={folder}/authority.pem;"
        f"connect_certificate_file={folder}/{name}.pem;connect_private_key_file={folder}/{name}.key"
    )


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    authority = certificate(tmp_path, "authority")
    for name in ("bridge", "plc", "hmi"):
        certificate(tmp_path, name, authority)
    return tmp_path


async def test_a_certificate_commands_by_its_own_keys(folder: Path) -> None:
    port = free_port()
    async with (
        rig(listen=[listening(folder, port)], controllers=["plc"]) as r,
        zenoh_peer(connecting(folder, port, "plc"), mode="client") as plc,
        zenoh_peer(connecting(folder, port, "hmi"), mode="client") as hmi,
    ):
        node_is(r.plant, NodeState.OPERATIONAL)
        drive_says(r.fu3, READY)
        key = f"{TOP}/@/controller/plc/conveyor/fu3/command/control_word"
        said = await hmi.do("get", key, payload="1150")
        assert (said["values"], said["errors"]) == ([], [])
        assert (await plc.command(key, 0x047E))["ok"]
        assert str(r.fu3.channel.owner) == "zenoh:plc"
        said = await plc.do("get", f"{TOP}/conveyor/fu3/command/keep_alive", payload="{}")
        assert json.loads(said["errors"][0])["code"] == "not_allowed"
        assert (await hmi.value(f"{TOP}/conveyor/fu3/supervision/owner"))["v"] == "zenoh:plc"
