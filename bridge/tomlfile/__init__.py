"""TOML files that people write: every fault at once, with its line and what would be right."""

from bridge.tomlfile.file import RawTable, TomlFile, dotted
from bridge.tomlfile.lines import Key

__all__ = ["Key", "RawTable", "TomlFile", "dotted"]
