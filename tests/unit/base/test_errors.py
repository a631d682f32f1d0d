"""Errors that a user gets as one sentence: exit codes, places in files, want of descriptors and memory."""

from __future__ import annotations

import errno

import pytest

from bridge.base.errors import BridgeError, Fault, FileFaults, OperationFailed, Unavailable, is_exhausted
from bridge.text import Text, render


@pytest.mark.parametrize(
    ("fault", "text"),
    [
        (
            Fault("a.toml", 3, "bus[0].name", "is missing", "a name"),
            "a.toml:3: bus[0].name: is missing (a name)",
        ),
        (Fault("a.toml", 3, "", "is not TOML"), "a.toml:3: is not TOML"),
        (Fault("a.toml", 0, "", "cannot be read", "look"), "a.toml: cannot be read (look)"),
        (Fault("a.toml", 0, "site", "is missing"), "a.toml: site: is missing"),
    ],
)
def test_a_fault_is_read_as_a_compilers(fault: Fault, text: str) -> None:
    assert str(fault) == text


def test_all_faults_of_a_file_are_told_and_can_be_asked_for() -> None:
    faults = [Fault("a.toml", 1, "", "one"), Fault("a.toml", 2, "", "two")]
    error = FileFaults(faults)
    assert str(error) == "a.toml:1: one\na.toml:2: two"
    assert error.faults == tuple(faults)
    assert isinstance(error.said, Text)


def test_an_error_keeps_the_text_that_it_tells_in_english() -> None:
    error = OperationFailed(Text.of("page.bus_deaf", bus="can0", why="no such device"))
    assert str(error) == "can0 cannot be listened to: no such device"
    assert render(error.said, "de") == "can0 lässt sich nicht mithören: no such device"


@pytest.mark.parametrize(
    ("error", "code"),
    [(OperationFailed("x"), 1), (FileFaults([]), 2), (Unavailable("x"), 3)],
)
def test_each_kind_of_error_has_its_exit_code(error: BridgeError, code: int) -> None:
    """docs/reference: 1 failed, 2 a fault in a file or in usage, 3 unavailable."""
    assert error.exit_code == code


@pytest.mark.parametrize("number", [errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM])
def test_no_descriptor_and_no_memory_left(number: int) -> None:
    assert is_exhausted(OSError(number, "x"))


@pytest.mark.parametrize("error", [None, ValueError(errno.EMFILE), OSError(errno.EADDRINUSE, "x")])
def test_anything_else_is_no_want_of_them(error: BaseException | None) -> None:
    assert not is_exhausted(error)
