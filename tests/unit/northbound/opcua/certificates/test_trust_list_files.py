"""The trust list as a file: what goes in comes out, and nobody has another's file."""

from __future__ import annotations

import pytest
from asyncua import ua
from hypothesis import given
from hypothesis import strategies as st

from bridge.northbound.opcua.certificates import trust_list_files
from bridge.northbound.opcua.certificates.trust_list_files import (
    TrustListContents,
    TrustListFiles,
    decoded,
    encoded,
)
from bridge.uaserver.library import ServiceError, StatusCodes
from tests.support.certificates import AUTHORITY, CLIENT, crl_of, make

ROOT, LEAF = make(AUTHORITY), make(CLIENT)
LISTS = TrustListContents((LEAF.certificate,), (), (ROOT.certificate,), (crl_of(ROOT),))
READ, WRITE = 1, 6


@pytest.fixture
def files() -> TrustListFiles:
    return TrustListFiles()


def refused(act: object, *arguments: object) -> int:
    with pytest.raises(ServiceError) as raised:
        act(*arguments)  # pyright: ignore
    return int(raised.value.code)


def test_what_is_written_is_what_is_read() -> None:
    assert decoded(encoded(LISTS, 15)) == LISTS


@pytest.mark.parametrize("mask", [ua.TrustListMasks.TrustedCertificates, ua.TrustListMasks.IssuerCrls])
def test_what_is_not_asked_for_is_not_there(mask: int) -> None:
    """None is left as it is; an empty list is one."""
    found = decoded(encoded(LISTS, mask))
    given = [found.trusted, found.trusted_crls, found.issuers, found.issuer_crls]
    assert [one is not None for one in given].count(True) == 1


@given(st.binary(max_size=300))
def test_noise_is_no_trust_list(noise: bytes) -> None:
    try:
        decoded(noise)
    except ServiceError:
        return
    assert decoded(noise).trusted in (None, ())


def test_more_than_a_folder_holds_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trust_list_files, "MOST_FILES", 0)
    assert refused(decoded, encoded(LISTS, 15)) == StatusCodes.BadEncodingLimitsExceeded


def test_it_is_read_in_parts_from_wherever(files: TrustListFiles) -> None:
    handle = files.open("s1", READ, b"abcdef", 0.0)
    assert files.read("s1", handle, 4, 0.0) == b"abcd"
    assert files.position("s1", handle, 0.0) == 4
    assert files.read("s1", handle, 99, 0.0) == b"ef"
    assert files.read("s1", handle, 99, 0.0) == b""
    files.seek("s1", handle, 1, 0.0)
    assert files.read("s1", handle, 2, 0.0) == b"bc"
    files.seek("s1", handle, 10**9, 0.0)
    assert files.position("s1", handle, 0.0) == 6
    assert files.close("s1", handle, 0.0) is None
    assert refused(files.read, "s1", handle, 1, 0.0) == StatusCodes.BadInvalidArgument


def test_a_written_one_is_alone_and_whole(files: TrustListFiles) -> None:
    handle = files.open("s1", WRITE, b"", 0.0)
    assert refused(files.open, "s2", READ, b"", 0.0) == StatusCodes.BadNotReadable
    assert refused(files.open, "s2", WRITE, b"", 0.0) == StatusCodes.BadNotWritable
    assert refused(files.read, "s1", handle, 1, 0.0) == StatusCodes.BadInvalidState
    files.write("s1", handle, b"abc", 0.0)
    files.write("s1", handle, b"def", 0.0)
    assert files.close("s1", handle, 0.0) == b"abcdef"
    assert not files.is_written


def test_nobody_has_anothers_file(files: TrustListFiles) -> None:
    handle = files.open("s1", WRITE, b"", 0.0)
    for act, more in ((files.write, (b"x",)), (files.read, (1,)), (files.seek, (0,)), (files.close, ())):
        assert refused(act, "s2", handle, *more, 0.0) == StatusCodes.BadInvalidArgument


def test_what_a_session_has_open_is_closed_with_it(files: TrustListFiles) -> None:
    files.open("s2", READ, b"", 0.0)
    handle = files.open("s1", WRITE, b"", 0.0)
    files.leave("s1")
    assert refused(files.write, "s1", handle, b"x", 0.0) == StatusCodes.BadInvalidArgument
    assert not files.is_written
    assert len(files) == 1


def test_who_goes_away_blocks_nobody_for_long_and_holds_little(
    files: TrustListFiles, monkeypatch: pytest.MonkeyPatch
) -> None:
    handle = files.open("s1", WRITE, b"", 0.0)
    files.open("s2", READ, b"", 61.0)
    for _ in range(9):
        files.open("s2", READ, b"", 61.0)
    assert refused(files.open, "s2", READ, b"", 61.0) == StatusCodes.BadResourceUnavailable
    assert len(files) == 10
    files.drop_idle(200.0)
    handle = files.open("s1", WRITE, b"", 200.0)
    monkeypatch.setattr(trust_list_files, "MOST_BYTES", 4)
    files.write("s1", handle, b"abcd", 200.0)
    assert refused(files.write, "s1", handle, b"e", 200.0) == StatusCodes.BadEncodingLimitsExceeded


@pytest.mark.parametrize("mode", [0, 2, 3, 4, 9, 255])
def test_other_modes_are_refused(files: TrustListFiles, mode: int) -> None:
    assert refused(files.open, "s1", mode, b"", 0.0) == StatusCodes.BadNotSupported
