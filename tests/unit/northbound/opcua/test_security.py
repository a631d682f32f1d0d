"""Passwords, certificates and trust of the OPC UA server; no server."""

from __future__ import annotations

import logging
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from asyncua import ua
from asyncua.common.connection import TransportLimits
from asyncua.common.utils import ServiceError
from asyncua.crypto.security_policies import SecurityPolicyAes256Sha256RsaPss, encrypt_asymmetric
from cryptography.hazmat.primitives.asymmetric.rsa import RSAPrivateKey, generate_private_key
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat

from bridge.base.errors import FileFaults
from bridge.command import Role
from bridge.config import OpcUaTable, UserTable
from bridge.northbound.opcua.certificates import OwnCertificate, TrustedCertificates, load_own, new_own
from bridge.northbound.opcua.users import Users, security_policies
from bridge.northbound.passwords import hash_password, verify_password
from bridge.uaserver.security import read_password
from bridge.uaserver.transport import Processor

URI = "urn:test:drivebridge"
Policy = ua.SecurityPolicyType


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory) -> OwnCertificate:
    folder = tmp_path_factory.mktemp("own")
    return new_own(folder / "c", folder / "k", URI, ["localhost"])


class TestPasswords:
    def test_a_hash_is_not_the_password_and_never_the_same(self) -> None:
        first, second = hash_password("swordfish"), hash_password("swordfish")
        assert first.startswith("$argon2id$")
        assert first != second
        assert "swordfish" not in first

    def test_only_the_right_password_is_right(self) -> None:
        line = hash_password("swordfish")
        assert verify_password(line, "swordfish")
        assert not verify_password(line, "Swordfish")
        assert not verify_password(line, "")
        assert not verify_password("nonsense", "swordfish")
        assert not verify_password(None, "nobody")

    async def test_a_user_has_the_role_of_the_site_file(self) -> None:
        line = hash_password("swordfish")
        users = Users(OpcUaTable(user=[UserTable(name="eva", role="engineer", password_hash=line)]))
        assert (await users.login("eva", "swordfish", "10.0.0.1")).role is Role.ENGINEER
        for name, password in (("eva", "x"), ("admin", "swordfish"), ("eva", "x" * 100_000)):
            with pytest.raises(ServiceError):
                await users.login(name, password, "10.0.0.1")
        users.close()

    @pytest.mark.parametrize(("setting", "role"), [("observer", Role.OBSERVER), ("operator", Role.OPERATOR)])
    def test_anonymous_is_what_the_site_file_says(self, setting: str, role: Role) -> None:
        users = Users(OpcUaTable.model_validate({"anonymous": setting}))
        assert users.anonymous("10.0.0.1").role is role
        assert ua.AnonymousIdentityToken in users.tokens
        with pytest.raises(ServiceError):
            Users(OpcUaTable()).anonymous("10.0.0.1")

    def test_all_faulty_users_are_named_at_once(self) -> None:
        line = hash_password("x")
        tables = [
            UserTable(name="anna", role="operator", password_hash=line),
            UserTable(name="anna", role="observer", password_hash="swordfish"),
            UserTable(name="anonymous", role="observer", password_hash=line),
        ]
        with pytest.raises(FileFaults) as raised:
            Users(OpcUaTable(user=tables))
        assert [fault.key for fault in raised.value.faults] == [
            "opcua.user[1].name",
            "opcua.user[1].password_hash",
            "opcua.user[2].name",
        ]


class TestReadPassword:
    NONCE = bytes(range(32))

    def token(self, content: bytes, algorithm: str | None = None) -> ua.UserNameIdentityToken:
        return ua.UserNameIdentityToken(UserName="anna", Password=content, EncryptionAlgorithm=algorithm)

    def encrypted(self, own: OwnCertificate, nonce: bytes, password: bytes = b"swordfish") -> object:
        whole = len(password + nonce).to_bytes(4, "little") + password + nonce
        key, policy = own.certificate.public_key(), SecurityPolicyAes256Sha256RsaPss.URI
        # What is longer than a block of RSA is encrypted in blocks (Part 4 §7.40.2.2).
        blocks = [encrypt_asymmetric(key, whole[at : at + 150], policy) for at in range(0, len(whole), 150)]
        return self.token(b"".join(block for block, _ in blocks), blocks[0][1])

    def test_an_encrypted_one_is_read(self, own: OwnCertificate) -> None:
        for password in ("swordfish", "", "ä" * 400):
            token = self.encrypted(own, self.NONCE, password.encode())
            assert read_password(token, self.NONCE, own.private_key, encrypted=False) == password

    def test_one_that_was_heard_before_is_not(self, own: OwnCertificate) -> None:
        token = self.encrypted(own, bytes(32))
        with pytest.raises(ServiceError):
            read_password(token, self.NONCE, own.private_key, encrypted=False)

    @pytest.mark.parametrize("sent", [b"", NONCE])
    def test_nothing_is_read_for_a_session_without_a_nonce(self, own: OwnCertificate, sent: bytes) -> None:
        """What ends with nothing would fit any message that was ever heard."""
        with pytest.raises(ServiceError):
            read_password(self.encrypted(own, sent), b"", own.private_key, encrypted=False)

    def test_clear_text_is_read_on_an_encrypted_channel_only(self, own: OwnCertificate) -> None:
        token = self.token(b"swordfish")
        assert read_password(token, self.NONCE, own.private_key, encrypted=True) == "swordfish"
        with pytest.raises(ServiceError):
            read_password(token, self.NONCE, own.private_key, encrypted=False)

    @pytest.mark.parametrize("algorithm", ["http://www.w3.org/2001/04/xmlenc#rsa-1_5", "rot13"])
    def test_weak_algorithms_are_refused(self, own: OwnCertificate, algorithm: str) -> None:
        with pytest.raises(ServiceError):
            read_password(self.token(bytes(256), algorithm), self.NONCE, own.private_key, encrypted=True)

    @pytest.mark.parametrize("size", [0, 1, 256, 257, 100_000])
    def test_noise_is_refused(self, own: OwnCertificate, size: int) -> None:
        token = self.token(b"\x07" * size, "http://www.w3.org/2001/04/xmlenc#rsa-oaep")
        with pytest.raises(ServiceError):
            read_password(token, self.NONCE, own.private_key, encrypted=True)


class TestOwnCertificate:
    @pytest.mark.parametrize("encoding", [Encoding.DER, Encoding.PEM])
    def test_one_that_the_site_names_is_taken(
        self, own: OwnCertificate, tmp_path: Path, encoding: Encoding
    ) -> None:
        certificate, key = tmp_path / "c", tmp_path / "k"
        certificate.write_bytes(own.certificate.public_bytes(encoding))
        key.write_bytes(key_content(own.private_key, encoding))
        assert load_own(certificate, key).certificate == own.certificate

    def test_both_faulty_files_are_named(self, tmp_path: Path) -> None:
        certificate, key = tmp_path / "c.pem", tmp_path / "k.pem"
        certificate.write_text("nonsense")
        with pytest.raises(FileFaults) as raised:
            load_own(certificate, key)
        assert [fault.file for fault in raised.value.faults] == [str(certificate), str(key)]
        assert "no such file" in raised.value.faults[1].message

    def test_a_key_of_another_certificate_is_named(self, own: OwnCertificate, tmp_path: Path) -> None:
        certificate, key = tmp_path / "c", tmp_path / "k"
        certificate.write_bytes(own.certificate.public_bytes(Encoding.DER))
        key.write_bytes(key_content(generate_private_key(65537, 2048), Encoding.PEM))
        with pytest.raises(FileFaults, match="is not the key of"):
            load_own(certificate, key)


def key_content(key: RSAPrivateKey, encoding: Encoding) -> bytes:
    return key.private_bytes(encoding, PrivateFormat.PKCS8, NoEncryption())


class TestTrust:
    def test_only_what_is_in_the_folder_is_trusted(
        self, own: OwnCertificate, tmp_path: Path, caplog: pytest.LogCaptureFixture
    ) -> None:
        (tmp_path / "readme.txt").write_text("put certificates here")
        with caplog.at_level(logging.WARNING):
            trusted = TrustedCertificates(tmp_path)
        assert "readme.txt" in caplog.text
        assert trusted.refusal(own.certificate) is not None
        (tmp_path / "client.pem").write_bytes(own.certificate.public_bytes(Encoding.PEM))
        assert trusted.refusal(own.certificate) is None

    def test_a_missing_folder_is_a_fault_of_the_site_file(self, tmp_path: Path) -> None:
        with pytest.raises(FileFaults, match="trusted_dir"):
            TrustedCertificates(tmp_path / "nowhere")


def test_an_open_endpoint_is_there_only_where_the_site_file_says_so() -> None:
    assert Policy.NoSecurity not in security_policies(OpcUaTable())
    assert Policy.NoSecurity in security_policies(OpcUaTable(no_security=True))
    assert all("SignAndEncrypt" in policy.name for policy in security_policies(OpcUaTable()))


def test_the_log_names_the_network_of_a_client_that_has_all_its_addresses(
    caplog: pytest.LogCaptureFixture,
) -> None:
    for host in ("2001:db8:1:2::7", "2001:db8:1:2:3:4:5:6"):
        peer = {"peername": (host, 50000, 0, 0)}
        transport: Any = SimpleNamespace(get_extra_info=peer.get)
        server: Any = None
        Processor(server, transport, TransportLimits())._fault(KeyError("x"))
    told = [record.getMessage() for record in caplog.records]
    assert len(told) == 2
    assert all("from 2001:db8:1:2::/64: " in line for line in told), told
