"""The corpus of guided fuzzing: a file for each parser, a line in hexadecimal for each input."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from pathlib import Path
from typing import Final

FOLDER: Final = Path(__file__).with_name("corpus")
_LONGEST: Final = 2048
"""Bytes of an input that is kept."""
_MOST: Final = 400
"""Inputs that are kept of a parser, the shortest."""


def kept(name: str) -> list[bytes]:
    """Inputs of the parser ``name``, the shortest first."""
    path = FOLDER / f"{name}.hex"
    return (
        [bytes.fromhex(line) for line in path.read_text(encoding="ascii").splitlines()]
        if path.exists()
        else []
    )


def keep(name: str, inputs: Iterable[bytes]) -> int:
    """Replace the inputs of the parser ``name``; returns how many were kept."""
    fit = sorted({one for one in inputs if len(one) <= _LONGEST}, key=lambda one: (len(one), one))[:_MOST]
    FOLDER.mkdir(exist_ok=True)
    (FOLDER / f"{name}.hex").write_text("".join(f"{one.hex()}\n" for one in fit), encoding="ascii")
    return len(fit)


def unpack(inputs: Iterable[bytes], folder: Path) -> None:
    """A file for each input, as libFuzzer reads them."""
    folder.mkdir(parents=True, exist_ok=True)
    for one in inputs:
        (folder / hashlib.sha256(one).hexdigest()[:16]).write_bytes(one)
