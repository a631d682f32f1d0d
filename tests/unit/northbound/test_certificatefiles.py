"""Certificates that a site file names: one that has run out, one of tomorrow, and the line of the fault."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID

from bridge.base.errors import Fault, FileFaults
from bridge.northbound.certificatefiles import check_validity, placed

NOW = datetime.now(UTC)
SITE = '[site]\nname = "hall"\n[opcua]\ncertificate = "own.der"\ntrust = [\n  "a.der",\n  "b.der",\n]\n'


def certificate(begins: datetime, ends: datetime) -> x509.Certificate:
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "bridge")])
    built = x509.CertificateBuilder().subject_name(name).issuer_name(name).public_key(key.public_key())
    built = built.serial_number(1).not_valid_before(begins).not_valid_after(ends)
    return built.sign(key, hashes.SHA256())


def test_one_that_is_valid_now_is_no_fault(caplog: pytest.LogCaptureFixture) -> None:
    check_validity("own.der", certificate(NOW - timedelta(1), NOW + timedelta(1)), "make a new one")
    assert caplog.messages == []


def test_one_that_has_run_out_is_told_with_its_day_and_what_to_do() -> None:
    ended = NOW - timedelta(1)
    with pytest.raises(FileFaults) as caught:
        check_validity("own.der", certificate(NOW - timedelta(9), ended), "make a new one")
    assert str(caught.value) == f"own.der: was valid until {ended:%Y-%m-%d} (make a new one)"


def test_one_of_tomorrow_is_most_often_a_wrong_clock(caplog: pytest.LogCaptureFixture) -> None:
    check_validity("own.der", certificate(NOW + timedelta(1), NOW + timedelta(9)), "make a new one")
    assert "is the clock right?" in caplog.messages[0]


@pytest.mark.parametrize(
    ("fault", "line", "text"),
    [
        (Fault("own.der", 0, "", "is odd"), 4, "opcua.certificate: own.der is odd"),
        (Fault("b.der", 0, "", "is odd"), 7, "opcua.trust[1]: b.der is odd"),
        (Fault("site file", 0, "opcua.trust[9].name", "is odd"), 5, "opcua.trust[9].name: is odd"),
        (Fault("site file", 0, "zenoh.user", "is odd"), 0, "zenoh.user: is odd"),
    ],
)
def test_a_fault_stands_at_the_line_of_its_key(tmp_path: Path, fault: Fault, line: int, text: str) -> None:
    site = tmp_path / "site.toml"
    site.write_text(SITE, encoding="utf-8")
    found = placed(fault, {"own.der": "opcua.certificate", "b.der": "opcua.trust[1]"}, site)
    assert found.line == line
    assert str(found) == (f"{site}:{line}: {text}" if line else f"{site}: {text}")


def test_a_fault_without_a_key_stays_as_it_is(tmp_path: Path) -> None:
    fault = Fault("elsewhere.pem", 0, "", "is odd")
    assert placed(fault, {}, tmp_path / "site.toml") is fault
