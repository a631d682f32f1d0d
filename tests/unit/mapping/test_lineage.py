"""Lineage of a mapping: those that it is made of, the nearest first."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.mapping.loader import lineage, mappings_dir

BASE = ["cia402/base", "generic/fault-advice"]


def test_a_mapping_without_a_base_is_alone() -> None:
    assert lineage("generic/fault-advice") == ["generic/fault-advice"]


def test_templates_count() -> None:
    assert lineage("cia402/homing") == ["cia402/homing", *BASE]


def test_a_file_of_the_same_name_in_the_sites_folder_is_one_with_it(tmp_path: Path) -> None:
    own = tmp_path / "cia402" / "base.toml"
    own.parent.mkdir()
    own.write_text('extends = "cia402/base"\n', encoding="utf-8")
    assert lineage("cia402/base", (tmp_path, mappings_dir())) == BASE
    assert lineage("cia402/homing", (tmp_path, mappings_dir())) == ["cia402/homing", *BASE]


def test_a_base_that_is_missing_is_named(tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text('extends = "acme/none"\n', encoding="utf-8")
    with pytest.raises(FileFaults, match="acme/none"):
        lineage("own", (tmp_path, mappings_dir()))
