"""Folders of certificates: what people put there counts at once, what strangers leave is bounded."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from cryptography.hazmat.primitives.serialization import Encoding
from hypothesis import given
from hypothesis import strategies as st

from bridge.base.errors import OperationFailed, Unavailable
from bridge.trust import store as module
from bridge.trust.files import thumbprint
from bridge.trust.store import TrustStore
from tests.support.certificates import AUTHORITY, CLIENT, Made, crl_of, make

ROOT = make(AUTHORITY)
LEAF = make(CLIENT, ROOT)
OTHER = make(CLIENT.but(subject="other"))


@pytest.fixture
def store(tmp_path: Path) -> TrustStore:
    made = TrustStore(tmp_path / "certificates")
    made.prepare()
    return made


def test_a_file_counts_as_long_as_it_is_there(store: TrustStore) -> None:
    assert not store.lists().trusts(LEAF.certificate)
    file = store.trusted / "any name.pem"
    file.write_bytes(LEAF.certificate.public_bytes(Encoding.PEM))
    assert store.lists().trusts(LEAF.certificate)
    file.write_bytes(OTHER.certificate.public_bytes(Encoding.PEM) + b"\n")
    assert not store.lists().trusts(LEAF.certificate)
    file.unlink()
    assert not store.lists().trusts(OTHER.certificate)


def test_revocation_lists_may_stand_with_either(store: TrustStore) -> None:
    (store.trusted / "a.crl").write_bytes(crl_of(ROOT).public_bytes(Encoding.DER))
    (store.issuers / "b.crl").write_bytes(crl_of(LEAF).public_bytes(Encoding.PEM))
    (store.issuers / "root.der").write_bytes(ROOT.der)
    lists = store.lists()
    assert len(lists.crls) == 2
    assert lists.issuers == (ROOT.certificate,)
    assert not lists.trusts(ROOT.certificate)


def test_what_is_no_certificate_is_named_once_and_left_out(
    store: TrustStore, caplog: pytest.LogCaptureFixture
) -> None:
    (store.trusted / "readme.txt").write_text("put certificates here")
    for name in ("one.der", "two.der"):
        (store.trusted / name).write_bytes(LEAF.der)
        assert store.lists().trusts(LEAF.certificate)
    assert caplog.text.count("readme.txt") == 1


def test_a_further_folder_is_trusted_too_and_one_that_is_gone_is_empty(tmp_path: Path) -> None:
    also = tmp_path / "also"
    also.mkdir()
    store = TrustStore(tmp_path / "certificates", [also])
    (also / "client.der").write_bytes(LEAF.der)
    assert store.lists().trusts(LEAF.certificate)
    (also / "client.der").unlink()
    also.rmdir()
    assert not store.lists().trusts(LEAF.certificate)


def test_a_folder_has_no_end_but_what_is_read_of_it(
    store: TrustStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "MOST_FILES", 3)
    for number in range(9):
        (store.trusted / f"{number}.der").write_bytes(LEAF.der if number == 8 else OTHER.der)
    assert store.lists().trusts(OTHER.certificate)
    assert not store.lists().trusts(LEAF.certificate)


def test_a_folder_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    (tmp_path / "certificates").write_text("in the way")
    with pytest.raises(Unavailable, match="certificates"):
        TrustStore(tmp_path / "certificates").prepare()


class TestRejected:
    def test_it_is_kept_whole_under_its_thumbprint(self, store: TrustStore) -> None:
        store.keep_rejected([LEAF.certificate, ROOT.certificate], "10.0.0.1", 0.0)
        (found,) = store.rejected_ones()
        assert found.sent == (LEAF.certificate, ROOT.certificate)
        assert found.file.name == f"{thumbprint(LEAF.certificate)}.der"

    def test_only_the_latest_are_kept(self, store: TrustStore, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(module, "MOST_REJECTED", 2)
        peers = [make(CLIENT.but(subject=f"peer {number}")) for number in range(4)]
        for number, peer in enumerate(peers):
            store.keep_rejected([peer.certificate], "10.0.0.1", 0.0)
            file = store.rejected / f"{thumbprint(peer.certificate)}.der"
            if file.exists():
                os.utime(file, (number, number))
        assert [one.certificate for one in store.rejected_ones()] == [
            one.certificate for one in (peers[3], peers[2])
        ]
        assert len(list(store.rejected.iterdir())) == 2

    def test_strangers_set_no_pace(self, store: TrustStore, monkeypatch: pytest.MonkeyPatch) -> None:
        written: list[Path] = []
        monkeypatch.setattr(module, "write_whole", lambda path, *_: written.append(path))

        def flood(source: str, now: float) -> int:
            before = len(written)
            for _ in range(20):
                store.keep_rejected([LEAF.certificate], source, now)
            return len(written) - before

        assert flood("10.0.0.1", 0.0) == 5
        assert flood("10.0.0.2", 0.0) == 5, "one address takes nothing from the other"
        assert flood("10.0.0.1", 60.0) == 1
        assert sum(flood(f"10.0.1.{host}", 61.0) for host in range(250)) <= 100
        assert len(vars(store)["_paces"]) <= 200

    @given(st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=60))
    def test_no_name_of_a_stranger_becomes_a_path(self, name: str) -> None:
        import tempfile

        try:
            made = make(CLIENT.but(subject=name))
        except (ValueError, UnicodeError):
            return
        with tempfile.TemporaryDirectory() as folder:
            store = TrustStore(Path(folder) / "certificates")
            store.prepare()
            before = set(Path(folder).rglob("*"))
            store.keep_rejected([made.certificate], "10.0.0.1", 0.0)
            assert {path.name for path in set(Path(folder).rglob("*")) - before} == {
                f"{thumbprint(made.certificate)}.der"
            }


class TestDecisions:
    def refused(self, store: TrustStore, made: Made = OTHER) -> str:
        store.keep_rejected([made.certificate], "10.0.0.1", 0.0)
        return thumbprint(made.certificate)

    @pytest.mark.parametrize(
        "write", [str, str.upper, lambda print_: print_[:12], lambda print_: f"{print_[:2]}:{print_[2:8]}"]
    )
    def test_a_refused_one_is_trusted_by_its_thumbprint(self, store: TrustStore, write: object) -> None:
        found = store.find_rejected(write(self.refused(store)))  # pyright: ignore
        store.trust(found.certificate)
        assert store.lists().trusts(OTHER.certificate)
        assert store.rejected_ones() == []

    def test_a_trusted_one_is_rejected_whatever_its_file(self, store: TrustStore) -> None:
        (store.trusted / "panel.der").write_bytes(OTHER.der)
        store.reject(store.find_trusted(thumbprint(OTHER.certificate)))
        assert not store.lists().trusts(OTHER.certificate)
        assert [one.certificate for one in store.rejected_ones()] == [OTHER.certificate]

    def test_one_that_cannot_be_read_keeps_nobody_else_out(self, store: TrustStore) -> None:
        store.trust(LEAF.certificate)
        (store.trusted / "broken.der").write_bytes(OTHER.der.replace(b"other", b"\xff\xfe\xff\xfe\xff"))
        assert store.lists().trusts(LEAF.certificate)

    def test_one_that_is_there_twice_is_rejected_in_both_files(self, store: TrustStore) -> None:
        (store.trusted / "panel.der").write_bytes(OTHER.der)
        store.trust(OTHER.certificate)
        store.trust(LEAF.certificate)
        store.reject(store.find_trusted(thumbprint(OTHER.certificate)))
        assert not store.lists().trusts(OTHER.certificate)
        assert store.lists().trusts(LEAF.certificate)

    @pytest.mark.parametrize("prefix", ["", "ab", "ffffffffffff", "../../etc"])
    def test_a_thumbprint_that_nobody_has_is_an_error(self, store: TrustStore, prefix: str) -> None:
        self.refused(store)
        for find in (store.find_rejected, store.find_trusted):
            with pytest.raises(OperationFailed, match="no certificate in"):
                find(prefix)

    def test_a_thumbprint_that_several_have_is_an_error(
        self, store: TrustStore, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(module, "_LEAST_PREFIX", 0)
        self.refused(store)
        self.refused(store, LEAF)
        with pytest.raises(OperationFailed, match="2 certificates"):
            store.find_rejected("")

    def test_a_folder_that_takes_nothing_is_named(self, store: TrustStore) -> None:
        store.trusted.rmdir()
        store.trusted.write_text("in the way")
        with pytest.raises(OperationFailed, match="cannot be written"):
            store.trust(OTHER.certificate)

    def test_a_file_that_cannot_be_taken_away_is_named(self, store: TrustStore) -> None:
        in_the_way = store.rejected / f"{thumbprint(OTHER.certificate)}.der"
        in_the_way.mkdir()
        with pytest.raises(OperationFailed, match=in_the_way.name):
            store.trust(OTHER.certificate)
