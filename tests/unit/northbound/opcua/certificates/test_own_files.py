"""Files of the own certificate: moved whole from where they were, and replaced as a pair."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import FileFaults, Unavailable
from bridge.config import OpcUaTable
from bridge.northbound.opcua.certificates import own_files
from bridge.northbound.opcua.certificates.own_certificate import OwnCertificate
from bridge.northbound.opcua.certificates.own_files import (
    CERTIFICATE,
    KEY,
    URI,
    expires_at,
    load_pair,
    own_folder,
    own_pair,
    put_pair,
)
from bridge.northbound.opcua.certificates.server_identity import server_identity
from tests.support.certificates import CLIENT, make, rsa_key

SETTINGS = OpcUaTable.model_validate({})
FIRST = OwnCertificate(make(CLIENT).certificate, rsa_key(1))
SECOND = OwnCertificate(make(CLIENT.but(key=rsa_key(2))).certificate, rsa_key(2))


class TestMove:
    def test_what_an_older_version_left_is_used_on_unchanged(self, tmp_path: Path) -> None:
        """Nothing that a client has trusted may change."""
        former = tmp_path / "opcua"
        former.mkdir()
        before = server_identity(SETTINGS, former)
        contents = {path.name: path.read_bytes() for path in former.iterdir()}
        folder = own_folder(tmp_path)
        after = server_identity(SETTINGS, folder)
        assert {path.name: path.read_bytes() for path in folder.iterdir()} == contents
        assert (after.certificate, after.application_uri) == (before.certificate, before.application_uri)
        assert not former.exists()

    @pytest.mark.parametrize("moved", [(), (KEY,), (KEY, URI)])
    def test_a_move_that_was_interrupted_goes_on(self, tmp_path: Path, moved: tuple[str, ...]) -> None:
        former = tmp_path / "opcua"
        former.mkdir()
        before = server_identity(SETTINGS, former)
        folder = tmp_path / "certificates" / "own"
        folder.mkdir(parents=True)
        for name in moved:
            (former / name).rename(folder / name)
        assert server_identity(SETTINGS, own_folder(tmp_path)).certificate == before.certificate

    def test_what_is_there_is_never_overwritten(self, tmp_path: Path) -> None:
        put_pair(own_folder(tmp_path), SECOND)
        (tmp_path / "opcua").mkdir()
        put_pair(tmp_path / "opcua", FIRST)
        assert load_pair(own_folder(tmp_path)).certificate == SECOND.certificate

    def test_a_folder_that_cannot_be_made_is_named(self, tmp_path: Path) -> None:
        (tmp_path / "certificates").write_text("in the way")
        with pytest.raises(Unavailable, match="certificates"):
            own_folder(tmp_path)


class TestPair:
    @pytest.mark.parametrize("step", range(3))
    def test_wherever_a_replacement_is_interrupted_one_of_the_two_is_there(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: int
    ) -> None:
        put_pair(tmp_path, FIRST)
        writes: list[Path] = []
        write, replace = own_files.write_whole, Path.replace

        def broken_write(path: Path, content: bytes) -> None:
            writes.append(path)
            if len(writes) > step:
                raise OSError(5, "power failure")
            write(path, content)

        def broken_replace(path: Path, target: Path) -> Path:
            if path.name.endswith(".next.pem"):
                raise OSError(5, "power failure")
            return replace(path, target)

        with monkeypatch.context() as patch:
            patch.setattr(own_files, "write_whole", broken_write)
            patch.setattr(Path, "replace", broken_replace)
            with pytest.raises(OSError, match="power failure"):
                put_pair(tmp_path, SECOND)
        expected = FIRST if step < 2 else SECOND
        for _ in range(2):
            found = load_pair(tmp_path)
            assert found.certificate == expected.certificate
            assert found.private_key.public_key() == expected.private_key.public_key()

    def test_two_that_do_not_belong_together_are_a_fault(self, tmp_path: Path) -> None:
        put_pair(tmp_path, FIRST)
        (tmp_path / KEY).write_bytes(make(CLIENT.but(key=rsa_key(3))).pem_key)
        with pytest.raises(FileFaults, match="is not the key of"):
            load_pair(tmp_path)


def test_the_end_of_its_validity_is_told(tmp_path: Path) -> None:
    assert expires_at(SETTINGS, tmp_path) is None
    put_pair(own_folder(tmp_path), FIRST)
    assert expires_at(SETTINGS, tmp_path) == FIRST.certificate.not_valid_after_utc
    (own_folder(tmp_path) / CERTIFICATE).write_text("nonsense")
    assert expires_at(SETTINGS, tmp_path) is None


def test_files_of_the_site_file_come_first(tmp_path: Path) -> None:
    named = OpcUaTable.model_validate({"certificate": "c.pem", "private_key": "k.pem"})
    assert own_pair(named, tmp_path) == (Path("c.pem"), Path("k.pem"))
    assert own_pair(SETTINGS, tmp_path) == (tmp_path / CERTIFICATE, tmp_path / KEY)
