"""TOML files that people write: every fault at once, with its line and what would be right."""

from bridge.tomlfile.file import RawTable as RawTable
from bridge.tomlfile.file import TomlFile as TomlFile
from bridge.tomlfile.file import dotted as dotted
from bridge.tomlfile.lines import Key as Key
from bridge.tomlfile.unfit import Unfit as Unfit
