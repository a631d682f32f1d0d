"""Files of others that travel inside the package, placed before hatchling collects those of a wheel."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

# hatchling loads this file by its path.
sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from tools import nodesets, page_scripts


class FetchedFiles(BuildHookInterface):  # type: ignore[type-arg]
    """hatchling calls it for an editable wheel, too."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        page_scripts.place(Path(self.root))
        nodesets.place(Path(self.root))
