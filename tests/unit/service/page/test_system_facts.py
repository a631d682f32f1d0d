"""Facts of the service for the page: no secret of the site file, and no failure for want of a file."""

from __future__ import annotations

import json
import socket
import tomllib
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.serialization import Encoding
from cryptography.x509.oid import NameOID
from hypothesis import given
from hypothesis import strategies as st

from bridge.northbound.page.system import CertificateFacts, UnreadablePart
from bridge.northbound.passwords import hash_password
from bridge.project import load_project
from bridge.service.page import system_facts as page_system
from bridge.service.page.system_facts import SystemOf, without_secrets
from bridge.trust import TrustStore
from bridge.trust.files import thumbprint
from tests.support import sites
from tests.support.certificates import CLIENT, DAY, NOW, make

HASH = "$argon2id$v=19$m=8,t=1,p=1$c2FsdHNhbHRzYWx0$C2zIbrBy8FoEh1bQ+nS6cg"
_QUOTES = ('"{}"', "'{}'", '"""{}"""', "'''\n{}'''", '"""\\\n  {}"""')


@pytest.mark.parametrize("quoted", _QUOTES)
@pytest.mark.parametrize("key", ["password_hash", '"password_hash"', "password_hash  "])
def test_no_way_to_write_a_hash_shows_it(quoted: str, key: str) -> None:
    text = f"[[opcua.user]]\nname = 'ann'\n{key} = {quoted.format(HASH)}\nrole = 'operator'\n"
    shown = without_secrets(text)
    assert "argon2" not in shown
    assert HASH[-10:] not in shown
    assert "operator" in shown
    assert tomllib.loads(shown)["opcua"]["user"][0]["name"] == "ann"
    assert shown.count("\n") == text.count("\n"), "findings name lines"


@given(
    st.text(alphabet=st.characters(exclude_categories=["Cs"], exclude_characters="\"'\\\n\r \t"), min_size=1)
)
def test_what_stands_in_place_of_a_hash_is_not_shown_either(secret: str) -> None:
    marked = f"s3cr3t{secret}s3cr3t"
    assert "s3cr3t" not in without_secrets(f'password_hash = "{marked}"')


def test_a_key_within_a_locator_is_not_shown() -> None:
    text = 'listen = ["tls/[::]:7447#listen_private_key_base64=QUJD;listen_certificate=/etc/c.pem"]'
    shown = without_secrets(text)
    assert "QUJD" not in shown
    assert "/etc/c.pem" in shown


def test_a_file_is_named_and_not_its_content() -> None:
    text = 'private_key = "/etc/drivebridge/key.pem"\npassword_file = "/etc/drivebridge/zenoh.users"'
    assert without_secrets(text) == text


def system(folder: Path, *parts: str) -> SystemOf:
    node = sites.node(sites.drive("fu1", "lease", 1000))
    path = sites.write(folder, sites.bus(node), *parts)
    return SystemOf(load_project(path))


@pytest.mark.landing
def test_the_site_file_is_checked_as_it_is_now(tmp_path: Path) -> None:
    facts = system(tmp_path)
    assert "changed" not in facts.site_file()
    assert [one for one in facts.check() if one["severity"] == "error"] == []
    path = Path(facts.site_file()["path"])
    path.write_text(path.read_text(encoding="utf-8").replace("fu1", "fu9"), encoding="utf-8")
    assert "changed" in facts.site_file()
    (finding, *_) = facts.check()
    assert finding["severity"] == "error"
    assert finding["line"] > 0
    assert "fu9" in finding["message"]
    assert finding["text"]["code"].startswith("file.")
    path.unlink()
    assert "cannot be read" in facts.site_file()["text"]
    assert facts.check()[0]["severity"] == "error"


def test_the_audit_log_is_read_from_its_end(tmp_path: Path) -> None:
    log = tmp_path / "audit.jsonl"
    facts = system(tmp_path, f'[audit]\nfile = "{log}"\n')
    assert facts.audit(10) == []
    written = [json.dumps({"t": f"2026-11-24T12:00:{n:02d}"}) for n in range(0, 30, 2)]
    refused = [json.dumps({"t": f"2026-11-24T12:00:{n:02d}"}) for n in range(1, 30, 2)]
    log.write_text("\n".join([*written, '{"t": "2026']), encoding="utf-8")
    (tmp_path / "audit-refused.jsonl").write_text("\n".join([*refused, ""]), encoding="utf-8")
    assert [one["t"][-2:] for one in facts.audit(3)] == ["29", "28", "27"], "what was refused, too"
    off = system(tmp_path, "[audit]\nenabled = false\n")
    assert off.audit(3) == []


def test_every_server_with_a_port_is_asked_for_its_clients(tmp_path: Path) -> None:
    facts = system(tmp_path, "[page]\n[modbus]\n[opcua]\n[zenoh]\n[audit]\n")
    assert facts.connections().keys() == {"modbus", "opcua", "page", "zenoh"}


def test_clients_are_those_of_the_ports_that_are_served(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        facts = system(tmp_path, sites.modbus(port))
        assert facts.connections() == {"modbus": []}
        with socket.create_connection(("127.0.0.1", port)) as client:
            host, own = client.getsockname()
            assert facts.connections() == {"modbus": [f"{host}:{own}"]}


def test_addresses_are_read_as_the_kernel_writes_them() -> None:
    assert page_system._address("0100007F:1F90") == "127.0.0.1:8080"
    assert page_system._address("00000000000000000000000001000000:0050") == "[::1]:80"
    assert page_system._address("0000000000000000FFFF00000100A8C0:0050") == "192.168.0.1:80"


def test_versions_are_there_and_looked_for_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    facts = system(tmp_path)
    assert {"drivebridge", "Python", "asyncua"} <= facts.versions().keys()
    monkeypatch.setattr(page_system, "version", lambda _: pytest.fail("it is known"))
    assert "asyncua" in facts.versions()
    assert hash_password("x").startswith("$argon2"), "what is looked for"


def certificate(subject: x509.Name) -> bytes:
    key = ec.generate_private_key(ec.SECP256R1())
    begin = datetime(2026, 1, 1, tzinfo=UTC)
    made = x509.CertificateBuilder(subject, subject, key.public_key(), 7, begin, begin + timedelta(days=9))
    return made.sign(key, SHA256()).public_bytes(Encoding.DER)


def test_each_certificate_is_told_whatever_the_others_are(tmp_path: Path) -> None:
    trusted = tmp_path / "trusted"
    facts = system(tmp_path, f'[opcua]\nlisten = "127.0.0.1:4840"\ntrusted_dir = "{trusted}"\n')
    assert facts.certificates() == [], "there is no such folder"
    trusted.mkdir()
    good = certificate(x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "box")]))
    (trusted / "a-malformed.der").write_bytes(good.replace(b"box", b"\xff\xfe\xff"))
    (trusted / "b.txt").write_text("no certificate", encoding="utf-8")
    (trusted / "c-folder").mkdir()
    (trusted / "d-good.der").write_bytes(good)
    told = {one.of: one for one in facts.certificates()}
    assert isinstance(told["d-good.der"], CertificateFacts)
    assert told["d-good.der"].subject == "CN=box"
    assert told["d-good.der"].until - told["d-good.der"].since == timedelta(days=9).total_seconds()
    unread = {name for name, one in told.items() if isinstance(one, UnreadablePart) and one.text}
    assert unread == {"a-malformed.der", "b.txt", "c-folder"}


def test_who_was_refused_is_told_with_the_reason(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    facts = system(tmp_path, '[opcua]\nlisten = "127.0.0.1:4840"\n')
    store = TrustStore(tmp_path / "state" / "certificates")
    store.prepare()
    stranger, known = make(), make(CLIENT.but(subject="known"))
    store.keep_rejected([stranger.certificate], "10.0.0.1", 0.0)
    store.trust(known.certificate)
    told = {one.of: one for one in facts.certificates() if isinstance(one, CertificateFacts)}
    assert (told["trusted"].subject, told["trusted"].wrong) == ("CN=known", "")
    assert (told["trusted"].since, told["trusted"].until) == (
        CLIENT.begins.timestamp(),
        CLIENT.ends.timestamp(),
    )
    refused = told["rejected"]
    assert (refused.subject, refused.thumbprint) == ("CN=client", thumbprint(stranger.certificate))
    assert str(refused.wrong) == "it is not trusted"
    assert [one.is_refused for one in told.values()] == [False, True]


def test_one_that_is_trusted_and_has_run_out_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    facts = system(tmp_path, '[opcua]\nlisten = "127.0.0.1:4840"\n')
    TrustStore(tmp_path / "state" / "certificates").trust(make(CLIENT.but(ends=NOW - DAY / 2)).certificate)
    (old,) = facts.certificates()
    assert isinstance(old, CertificateFacts)
    assert old.of == "trusted"
    assert "was valid until" in str(old.wrong)


def test_what_is_in_trusted_dir_counts_for_who_was_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    facts = system(tmp_path, f'[opcua]\nlisten = "127.0.0.1:4840"\ntrusted_dir = "{tmp_path / "more"}"\n')
    store, client = TrustStore(tmp_path / "state" / "certificates"), make()
    store.prepare()
    store.keep_rejected([client.certificate], "10.0.0.1", 0.0)

    def wrong() -> str:
        return next(
            str(one.wrong)
            for one in facts.certificates()
            if isinstance(one, CertificateFacts) and one.is_refused
        )

    assert wrong() == "it is not trusted"
    (tmp_path / "more").mkdir()
    (tmp_path / "more" / "panel.der").write_bytes(client.der)
    assert wrong() == ""


def test_a_folder_that_may_not_be_read_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    facts = system(tmp_path, f'[opcua]\nlisten = "127.0.0.1:4840"\ntrusted_dir = "{tmp_path / "trusted"}"\n')

    def refused(self: Path) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "iterdir", refused)
    assert facts.certificates() == [UnreadablePart("trusted", "Permission denied")]


def test_lines_of_the_log_that_are_no_entries_are_left_out(tmp_path: Path) -> None:
    log = tmp_path / "audit.jsonl"
    facts = system(tmp_path, f'[audit]\nfile = "{log}"\n')
    log.write_text('[1]\n7\nnull\n"t"\n{"t": "2026"}\n' + "[" * 100_000 + "\n", encoding="utf-8")
    assert facts.audit(10) == [{"t": "2026"}]
