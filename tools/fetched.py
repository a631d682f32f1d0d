"""Files that are fetched when the package is built: a cache for them, and writing whole or not at all."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path


def cache(name: str) -> Path:
    """The folder ``name`` in ``~/.cache/drivebridge``, or below ``XDG_CACHE_HOME``."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "drivebridge" / name


def write(path: Path, content: bytes) -> None:
    """Whole or not at all: two builds may run at a time."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile(dir=path.parent, delete=False) as file:
        file.write(content)
    Path(file.name).chmod(0o644)
    Path(file.name).replace(path)
