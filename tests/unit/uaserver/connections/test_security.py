"""Passwords and signatures that come through a channel; no server."""

from __future__ import annotations

from typing import ClassVar

import pytest
from asyncua import ua
from asyncua.common.utils import ServiceError
from asyncua.crypto.security_policies import SecurityPolicyAes256Sha256RsaPss, encrypt_asymmetric
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.asymmetric.padding import MGF1, PSS, PKCS1v15
from cryptography.hazmat.primitives.hashes import SHA256

from bridge.northbound.opcua.certificates.own_certificate import OwnCertificate, new_own
from bridge.uaserver.connections.security import check_policy, read_password, read_user_certificate
from tests.support.certificates import CLIENT, make, rsa_key

URI = "urn:test:drivebridge"
Policy = ua.SecurityPolicyType


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory) -> OwnCertificate:
    folder = tmp_path_factory.mktemp("own")
    return new_own(folder / "c", folder / "k", URI, ["localhost"])


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
        """A text that ends with an empty nonce would fit any recorded message."""
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


class TestReadUserCertificate:
    SIGNED = b"certificate of the server" + bytes(range(32))
    PKCS1 = "http://www.w3.org/2001/04/xmldsig-more#rsa-sha256"

    def token(self, content: bytes) -> ua.X509IdentityToken:
        return ua.X509IdentityToken(CertificateData=content)

    def signature(self, content: bytes, algorithm: str | None = PKCS1) -> ua.SignatureData:
        return ua.SignatureData(Algorithm=algorithm, Signature=content)

    def signed(self, content: bytes = SIGNED) -> bytes:
        return rsa_key(1).sign(content, PKCS1v15(), SHA256())

    def test_the_owner_of_the_key_is_the_user(self) -> None:
        made = make()
        pss = rsa_key(1).sign(self.SIGNED, PSS(MGF1(SHA256()), 32), SHA256())
        other = self.signature(pss, "http://opcfoundation.org/UA/security/rsa-pss-sha2-256")
        for signature in (self.signature(self.signed()), other):
            assert read_user_certificate(self.token(made.der), signature, self.SIGNED) == made.certificate

    @pytest.mark.parametrize("content", [b"", b"nonsense", None])
    def test_what_is_no_certificate_of_rsa_is_invalid(self, content: bytes | None) -> None:
        elliptic = make(CLIENT.but(key=ec.generate_private_key(ec.SECP256R1())))
        token = self.token(elliptic.der if content is None else content)
        with pytest.raises(ServiceError) as refused:
            read_user_certificate(token, self.signature(self.signed()), self.SIGNED)
        assert refused.value.code == ua.StatusCodes.BadIdentityTokenInvalid

    @pytest.mark.parametrize("kind", ["none", "empty", "heard before", "forged", "weak", "of another kind"])
    def test_without_its_signature_nobody_is_the_user(self, kind: str) -> None:
        signature = {
            "none": None,
            "empty": ua.SignatureData(),
            "heard before": self.signature(self.signed(b"another nonce")),
            "forged": self.signature(rsa_key(2).sign(self.SIGNED, PKCS1v15(), SHA256())),
            "weak": self.signature(self.signed(), "http://www.w3.org/2000/09/xmldsig#rsa-sha1"),
            "of another kind": self.signature(
                self.signed(), "http://opcfoundation.org/UA/security/rsa-pss-sha2-256"
            ),
        }[kind]
        with pytest.raises(ServiceError) as refused:
            read_user_certificate(self.token(make().der), signature, self.SIGNED)
        assert refused.value.code == ua.StatusCodes.BadUserSignatureInvalid


class TestPolicyOfAToken:
    POLICY = ua.UserTokenPolicy(PolicyId="anonymous", TokenType=ua.UserTokenType.Anonymous)
    ENDPOINTS: ClassVar = [ua.EndpointDescription(UserIdentityTokens=[POLICY])]

    @pytest.mark.parametrize("name", ["anonymous", None, ""])
    def test_one_that_an_endpoint_has_is_taken_and_so_is_none(self, name: str | None) -> None:
        check_policy(ua.AnonymousIdentityToken(PolicyId=name), self.ENDPOINTS)
        check_policy(ua.ExtensionObject(), self.ENDPOINTS)

    def test_another_is_refused(self) -> None:
        with pytest.raises(ServiceError) as refused:
            check_policy(ua.AnonymousIdentityToken(PolicyId="nothing"), self.ENDPOINTS)
        assert refused.value.code == ua.StatusCodes.BadIdentityTokenInvalid

    def test_what_is_not_offered_at_all_is_left_to_who_knows_the_users(self) -> None:
        check_policy(ua.UserNameIdentityToken(PolicyId="username"), self.ENDPOINTS)
