"""The socket between bus process and fronts: where it is, and that nobody else may use its folder."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import pytest

from bridge.base.errors import Unavailable
from bridge.mirror.endpoint import close_to_others, prepare_folder, socket_endpoint, socket_path, tap_path


def test_it_is_named_by_its_site(tmp_path: Path) -> None:
    endpoint = socket_endpoint(Path("/run/drivebridge"), "hall")
    assert endpoint == "unixsock-stream//run/drivebridge/hall.sock"
    assert socket_path(endpoint) == Path("/run/drivebridge/hall.sock")
    assert tap_path(Path("/run/drivebridge"), "hall", "can0") == Path("/run/drivebridge/hall-can0.frames")


def test_a_path_that_is_too_long_for_a_socket_is_told() -> None:
    """unix(7): 108 bytes with their end; zenoh puts a lock file beside it."""
    room = 100 - len("/hall.sock")
    socket_endpoint(Path("/" + "x" * (room - 1)), "hall")
    with pytest.raises(Unavailable, match="too long for a socket"):
        socket_endpoint(Path("/" + "x" * room), "hall")
    with pytest.raises(Unavailable, match="too long for a socket"):
        socket_endpoint(Path("/" + "ü" * (room // 2)), "hall")


@pytest.mark.parametrize("sign", "?#;")
def test_signs_that_mean_something_to_zenoh_are_refused(sign: str) -> None:
    with pytest.raises(Unavailable, match=r"must not contain \? # or ;"):
        socket_endpoint(Path(f"/run/a{sign}b"), "hall")


def mode_of(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


def test_its_folder_is_made_for_us_alone(tmp_path: Path) -> None:
    endpoint = socket_endpoint(tmp_path / "a" / "b", "hall")
    prepare_folder(endpoint)
    assert mode_of(tmp_path / "a" / "b") == 0o700
    prepare_folder(endpoint)


@pytest.mark.parametrize("mode", [0o720, 0o702, 0o777])
def test_a_folder_that_others_may_write_to_is_refused(tmp_path: Path, mode: int) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "run").chmod(mode)
    with pytest.raises(Unavailable, match="others may write"):
        prepare_folder(socket_endpoint(tmp_path / "run", "hall"))


def test_a_folder_that_cannot_be_made_is_told(tmp_path: Path) -> None:
    (tmp_path / "run").write_text("a file")
    with pytest.raises(Unavailable, match="cannot be made"):
        prepare_folder(socket_endpoint(tmp_path / "run" / "b", "hall"))


def test_only_our_user_may_connect(tmp_path: Path) -> None:
    endpoint = socket_endpoint(tmp_path, "hall")
    before = os.umask(0)
    try:
        socket_path(endpoint).touch(0o666)
    finally:
        os.umask(before)
    close_to_others(endpoint)
    assert mode_of(socket_path(endpoint)) == 0o600
