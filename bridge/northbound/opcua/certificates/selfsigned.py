"""A certificate of our own making, as OPC UA asks for (Part 4 §6.1.2, Part 6 §6.2.2).

With cryptography alone: the bus process makes it, and asyncua stays out of that.
"""

from __future__ import annotations

import socket
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from typing import Final

from cryptography import x509
from cryptography.hazmat.primitives.asymmetric.rsa import RSAPrivateKey, generate_private_key
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from bridge.northbound.opcua.certificates.ownnames import general_name

KEY_BITS: Final = 2048
_VALID_DAYS: Final = 3650
_LONGEST_NAME: Final = 64
"""Most characters of a common name (RFC 5280, ub-common-name)."""


def generate_key() -> RSAPrivateKey:
    return generate_private_key(65537, KEY_BITS)


def new_key() -> tuple[RSAPrivateKey, bytes]:
    """A key, and its file in PEM."""
    key = generate_key()
    return key, key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())


def self_signed(key: RSAPrivateKey, application_uri: str, names: Sequence[str]) -> x509.Certificate:
    """A certificate signed with ``key``. ``names`` are host names and addresses by which the server is
    reached."""
    host = socket.gethostname()
    name = x509.Name(
        [
            x509.NameAttribute(NameOID.COMMON_NAME, f"drivebridge@{host}"[:_LONGEST_NAME]),
            x509.NameAttribute(NameOID.ORGANIZATION_NAME, "drivebridge"),
        ]
    )
    known_by = [x509.UniformResourceIdentifier(application_uri), *map(general_name, names)]
    now = datetime.now(UTC)
    serial, public = x509.random_serial_number(), key.public_key()
    key_id = x509.SubjectKeyIdentifier.from_public_key(public)
    extensions: list[x509.ExtensionType] = [
        key_id,
        x509.AuthorityKeyIdentifier(key_id.digest, [x509.DirectoryName(name)], serial),
        x509.SubjectAlternativeName(known_by),
        x509.BasicConstraints(ca=True, path_length=0),
        _USAGE,
        x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH, ExtendedKeyUsageOID.CLIENT_AUTH]),
    ]
    builder = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .not_valid_before(now)
        .not_valid_after(now + timedelta(days=_VALID_DAYS))
        .serial_number(serial)
        .public_key(public)
    )
    for extension in extensions:
        builder = builder.add_extension(extension, critical=False)
    return builder.sign(key, SHA256())


_USAGE: Final = x509.KeyUsage(
    digital_signature=True,
    content_commitment=True,
    key_encipherment=True,
    data_encipherment=True,
    key_agreement=False,
    key_cert_sign=True,
    crl_sign=False,
    encipher_only=False,
    decipher_only=False,
)
