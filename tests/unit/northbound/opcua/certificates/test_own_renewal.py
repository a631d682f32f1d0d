"""Renewal of the own certificate: what is asked of an authority, and what of it is taken."""

from __future__ import annotations

import pytest
from cryptography import x509
from cryptography.hazmat.primitives.asymmetric.rsa import RSAPrivateKey

from bridge.northbound.opcua.certificates.own_certificate import OwnCertificate
from bridge.northbound.opcua.certificates.own_renewal import PEM, OwnRenewal
from bridge.uaserver.library import ServiceError, StatusCodes
from tests.support.certificates import AUTHORITY, CLIENT, CLIENT_URI, DAY, NOW, Made, make, rsa_key

ROOT = make(AUTHORITY)
NONCE = bytes(32)


@pytest.fixture
def renewal() -> OwnRenewal:
    own = OwnCertificate(make(CLIENT).certificate, rsa_key(1))
    return OwnRenewal(own, CLIENT_URI, ["bridge.example", "10.0.0.7"])


def issued(request: bytes, **changes: object) -> Made:
    """What an authority makes of a request."""
    asked = x509.load_der_x509_csr(request)
    for number in range(8):
        key = rsa_key(number)
        if key.public_key() == asked.public_key():
            return make(CLIENT.but(key=key, **changes), ROOT)
    raise AssertionError("another key")


def refused(
    renewal: OwnRenewal, content: bytes, issuers: list[bytes], form: str = "", key: bytes = b""
) -> int:
    with pytest.raises(ServiceError) as raised:
        renewal.update(content, issuers, form, key, NOW)
    assert renewal.pending is None
    return int(raised.value.code)


def test_the_request_has_the_application_and_every_name(renewal: OwnRenewal) -> None:
    asked = x509.load_der_x509_csr(renewal.request("CN=hall 3/O=plant", b"", new_key=False))
    assert asked.is_signature_valid
    assert asked.public_key() == rsa_key(1).public_key()
    assert asked.subject.rfc4514_string() in ("O=plant,CN=hall 3", "CN=hall 3,O=plant")
    names = asked.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    assert names.get_values_for_type(x509.UniformResourceIdentifier) == [CLIENT_URI]
    assert names.get_values_for_type(x509.DNSName) == ["bridge.example"]


def test_a_new_key_needs_the_clients_chance_and_is_used_with_what_comes_back(renewal: OwnRenewal) -> None:
    with pytest.raises(ServiceError):
        renewal.request("", b"short", new_key=True)
    asked = x509.load_der_x509_csr(renewal.request("", NONCE, new_key=True))
    assert asked.public_key() != rsa_key(1).public_key()
    assert asked.subject == renewal.own.certificate.subject


def test_what_an_authority_has_made_is_applied_once(renewal: OwnRenewal) -> None:
    made = issued(renewal.request("", b"", new_key=False))
    renewal.update(made.der, [ROOT.der], "", b"", NOW)
    assert renewal.own.certificate != made.certificate, "not yet"
    assert renewal.applied().certificate == made.certificate
    with pytest.raises(ServiceError) as raised:
        renewal.applied()
    assert raised.value.code == StatusCodes.BadNothingToDo


def test_a_key_may_come_along(renewal: OwnRenewal) -> None:
    made = make(CLIENT.but(key=rsa_key(3)))
    renewal.update(made.der, [], PEM, made.pem_key, NOW)
    assert isinstance(made.key, RSAPrivateKey)
    assert renewal.applied().private_key.public_key() == made.key.public_key()


def test_each_that_cannot_be_used_is_refused(renewal: OwnRenewal) -> None:
    codes = StatusCodes
    own = CLIENT
    assert refused(renewal, b"nonsense", []) == codes.BadCertificateInvalid
    assert refused(renewal, make(own.but(key=rsa_key(3))).der, []) == codes.BadSecurityChecksFailed
    assert refused(renewal, make(own.but(uri="urn:other")).der, []) == codes.BadCertificateUriInvalid
    assert refused(renewal, make(own.but(ends=NOW - DAY / 2)).der, []) == codes.BadCertificateTimeInvalid
    weak = make(own.but(key=rsa_key(4, 1024)))
    assert refused(renewal, weak.der, [], PEM, weak.pem_key) == codes.BadCertificatePolicyCheckFailed
    assert refused(renewal, make(own).der, [ROOT.der]) == codes.BadSecurityChecksFailed
    assert refused(renewal, make(own).der, [b"nonsense"]) == codes.BadCertificateInvalid
    other = make(own.but(key=rsa_key(3)))
    assert refused(renewal, other.der, [], "PFX", b"x") == codes.BadNotSupported
    assert refused(renewal, other.der, [], PEM, b"x") == codes.BadInvalidArgument
    assert refused(renewal, other.der, [], PEM, make(own).pem_key) == codes.BadSecurityChecksFailed


@pytest.mark.parametrize("subject", ["nonsense", "CN", "=x", "CN=a,,O=b"])
def test_a_subject_that_is_none_is_refused(renewal: OwnRenewal, subject: str) -> None:
    with pytest.raises(ServiceError):
        renewal.request(subject, b"", new_key=False)
