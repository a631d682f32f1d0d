"""A site's own folder of mappings, in which a family of the invented maker is a template."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.mapping import Family, load_family
from bridge.mapping.loader import mapping_folders
from tests.support.invented import SITE, SPIN

BASE = SPIN.replace('source = "nobody\'s manual"', 'source = "nobody\'s manual"\ntemplate = true', 1)


class Folder:
    """A site's own folder of mappings."""

    def __init__(self, at: Path) -> None:
        self.top = at
        self.site = at / "site.toml"
        self.site.write_text(SITE.format(drive="", node=""))

    def add(self, name: str, text: str) -> Path:
        path = self.top / "mappings" / f"{name}.toml"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        return path

    def load(self, name: str) -> Family:
        return load_family(name, mapping_folders(self.site))

    def told(self, name: str) -> list[str]:
        with pytest.raises(FileFaults) as caught:
            self.load(name)
        return [str(fault).removeprefix(f"{self.top}/mappings/") for fault in caught.value.faults]
