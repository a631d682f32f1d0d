"""The certificate of our own making."""

from __future__ import annotations

import socket

import pytest
from cryptography import x509
from cryptography.hazmat.primitives.serialization import load_pem_private_key

from bridge.northbound.opcua.certificates.selfsigned import KEY_BITS, new_key, self_signed

KEY, PEM = new_key()


def test_the_file_of_a_key_is_that_key() -> None:
    assert KEY.key_size == KEY_BITS
    assert load_pem_private_key(PEM, None).public_key() == KEY.public_key()


def test_it_names_the_server_by_uri_host_and_address(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(socket, "gethostname", lambda: "x" * 100)
    made = self_signed(KEY, "urn:box:drivebridge", ["box.example", "10.0.0.1", "2001:db8::1"])
    names = made.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    assert names.get_values_for_type(x509.UniformResourceIdentifier) == ["urn:box:drivebridge"]
    assert names.get_values_for_type(x509.DNSName) == ["box.example"]
    assert list(map(str, names.get_values_for_type(x509.IPAddress))) == ["10.0.0.1", "2001:db8::1"]
    (common,) = made.subject.get_attributes_for_oid(x509.NameOID.COMMON_NAME)
    assert len(common.value) == 64
    made.verify_directly_issued_by(made)


def test_no_two_have_one_number() -> None:
    assert len({self_signed(KEY, "urn:x", []).serial_number for _ in range(3)}) == 3
