"""The server's own certificate; no server."""

from __future__ import annotations

from pathlib import Path

import pytest
from cryptography.hazmat.primitives.asymmetric.rsa import RSAPrivateKey, generate_private_key
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat

from bridge.base.errors import FileFaults
from bridge.northbound.opcua.certificates.own_certificate import OwnCertificate, load_own, new_own

URI = "urn:test:drivebridge"


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory) -> OwnCertificate:
    folder = tmp_path_factory.mktemp("own")
    return new_own(folder / "c", folder / "k", URI, ["localhost"])


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
