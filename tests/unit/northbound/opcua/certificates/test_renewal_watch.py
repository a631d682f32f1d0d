"""Watch on the own certificate: what has been renewed is taken up, and nothing else."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.config import OpcUaTable
from bridge.northbound.opcua.certificates.own_certificate import OwnCertificate
from bridge.northbound.opcua.certificates.own_files import CERTIFICATE, put_pair
from bridge.northbound.opcua.certificates.renewal_watch import RenewalWatch
from tests.support.certificates import CLIENT, CLIENT_URI, Made, make, rsa_key

FIRST, SECOND = make(CLIENT), make(CLIENT.but(key=rsa_key(2)))


def put(folder: Path, made: Made) -> None:
    put_pair(folder, OwnCertificate(made.certificate, made.key))  # pyright: ignore


@pytest.fixture
def watch(tmp_path: Path) -> RenewalWatch:
    put(tmp_path, FIRST)
    return RenewalWatch(OpcUaTable.model_validate({}), tmp_path, CLIENT_URI)


def test_a_renewed_one_is_found_once(watch: RenewalWatch, tmp_path: Path) -> None:
    assert watch.look() is None
    put(tmp_path, SECOND)
    found = watch.look()
    assert found is not None
    assert found.certificate == SECOND.certificate
    assert watch.look() is None


def test_of_two_files_the_second_is_waited_for(tmp_path: Path) -> None:
    """Those of the site file are replaced by somebody else, one after the other."""
    certificate, key = tmp_path / "c.der", tmp_path / "k.pem"
    certificate.write_bytes(FIRST.der)
    key.write_bytes(FIRST.pem_key)
    named = OpcUaTable.model_validate({"certificate": str(certificate), "private_key": str(key)})
    watch = RenewalWatch(named, tmp_path, CLIENT_URI)
    certificate.write_bytes(SECOND.der)
    assert watch.look() is None
    key.unlink()
    assert watch.look() is None
    key.write_bytes(SECOND.pem_key)
    found = watch.look()
    assert found is not None
    assert found.certificate == SECOND.certificate


def test_another_applications_and_what_is_none_are_named_once_and_left(
    watch: RenewalWatch, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    put(tmp_path, make(CLIENT.but(uri="urn:somebody:else")))
    (tmp_path / CERTIFICATE).touch()
    assert [watch.look(), watch.look()] == [None, None]
    assert caplog.text.count("urn:somebody:else") == 1
    (tmp_path / CERTIFICATE).write_text("nonsense, and long enough")
    assert watch.look() is None
    assert "is not taken up" in caplog.text
    (tmp_path / CERTIFICATE).unlink()
    assert watch.look() is None
