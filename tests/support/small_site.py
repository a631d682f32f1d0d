"""A site file as small as it may be, and what is told of it with some of it changed."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.config import Site, load_site

SMALL = """
[site]
name = "hall"
[[bus]]
name = "can0"
interface = "virtual"
[[bus.node]]
name = "conveyor"
id = 5
mapping = "nord/sk-tu4-cao"
[[bus.node.drive]]
slot = "fu1"
"""


def load(folder: Path, text: str) -> Site:
    path = folder / "site.toml"
    path.write_text(text, encoding="utf-8")
    return load_site(path)


def faults(folder: Path, text: str) -> list[str]:
    """The faults as the user sees them, from the line number on."""
    with pytest.raises(FileFaults) as caught:
        load(folder, text)
    top = str(folder / "site.toml")
    return [str(fault).removeprefix(f"{top}:").removeprefix(top).strip(": ") for fault in caught.value.faults]
