"""The site with two buses that commands of the command line are given."""

from __future__ import annotations

from pathlib import Path

import pytest

SITE = """
[site]
name = "two"
[[bus]]
name = "north"
interface = "socketcan"
channel = "can0"
[[bus.node]]
name = "conveyor"
id = 5
mapping = "nord/sk-tu4-cao"
[[bus.node.drive]]
slot = "fu1"
[[bus]]
name = "south"
interface = "socketcan"
channel = "can1"
"""


@pytest.fixture
def site(tmp_path: Path) -> Path:
    path = tmp_path / "site.toml"
    path.write_text(SITE, "utf-8")
    return path
