"""What holds for all tests: none leaves a task, a thread, a process or a socket behind, and what takes long
waits for the night. And five ways in which they save time."""

from __future__ import annotations

import gc
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import bridge.catalogue.site
import bridge.mapping
import bridge.mapping.loader
import bridge.mapping.site_families
from bridge.mapping import Family
from bridge.mapping.loader import is_template, load_family, mappings_dir
from bridge.parameter import AxisNames
from tests.support.leaks import leaves_nothing, module_leaves_nothing
from tests.support.nightly import pytest_collection_modifyitems, pytest_configure

__all__ = ["leaves_nothing", "module_leaves_nothing", "pytest_collection_modifyitems", "pytest_configure"]

_load_own = cache(load_family)


def _load_family(name: str, folders: Sequence[Path] = ()) -> Family:
    """The program's own mappings do not change meanwhile: each is read once."""
    is_own = tuple(folders) in ((), (mappings_dir(),))
    return _load_own(name) if is_own else load_family(name, folders)


bridge.mapping.load_family = bridge.mapping.site_families.load_family = _load_family

_OWN = mappings_dir()
_is_own_template = cache(is_template)


def _is_template(path: Path) -> bool:
    return _is_own_template(path) if path.is_relative_to(_OWN) else is_template(path)


bridge.mapping.loader.is_template = _is_template

_names: dict[int, tuple[Family, AxisNames]] = {}


def _names_of(family: Family) -> AxisNames:
    """Nothing changes them either: one for each family, however many catalogues have it."""
    kept = _names.get(id(family))
    if kept is None or kept[0] is not family:
        kept = _names[id(family)] = family, AxisNames(family)
    return kept[1]


bridge.catalogue.site.AxisNames = _names_of


def pytest_collection() -> None:
    """While everything is imported, next to nothing becomes garbage: looking for it is half of the time."""
    gc.disable()


def pytest_collection_finish() -> None:
    """What has been imported stays, so that nobody looks for garbage in it again and again."""
    gc.enable()
    gc.collect()
    gc.freeze()
