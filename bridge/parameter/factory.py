"""Settings of a drive by its device description: which there are, and the factory's values."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from bridge.canopen.sdo import COMMANDS
from bridge.eds import Description, Entry, read_whole_device_file
from bridge.eds.value_text import BadValue, encode
from bridge.image import Value
from bridge.mapping.model import ObjectRef
from bridge.parameter.codec import decode, encode_value
from bridge.parameter.error import ParameterError
from bridge.parameter.names import Names

DESCRIPTIONS: Final = (".eds", ".dcf", ".xdd", ".xdc")
_APPLICATION: Final = range(0x2000, 0x10000)


def described(file: Path, names: Names) -> list[ObjectRef]:
    """The settings that ``file`` describes: what can be read and written, and is no command. Raises
    ``FileFaults``."""
    return [ObjectRef(one.index, one.sub) for one in _settings(read_whole_device_file(file), names)]


def factory(file: Path, names: Names, node_id: int, modules: Sequence[str] = ()) -> dict[str, Value]:
    """The factory settings that ``file`` has with these ``modules``, by name. Raises ``FileFaults``."""
    found: dict[str, Value] = {}
    for one in _settings(read_whole_device_file(file, modules), names):
        entry = names.at(ObjectRef(one.index, one.sub))
        plain = one.default.at(node_id) if one.default else None
        if plain is None or one.data_type is None:
            continue
        try:
            data = encode(plain, one.data_type)
            value = decode(entry, data)
            encode_value(entry, value, data)
        except (BadValue, ParameterError):
            # The file and the mapping do not agree about this one: nothing is known of it.
            continue
        found[entry.name] = value
    return found


def _settings(description: Description, names: Names) -> Iterator[Entry]:
    for one in description.objects:
        for entry in one.entries:
            if entry.index not in _APPLICATION or entry.index in COMMANDS or entry.refuses_download:
                continue
            known = names.at(ObjectRef(entry.index, entry.sub))
            if known.definition is not None and not known.definition.backup:
                continue
            is_open = entry.access.readable and entry.access.writable
            if is_open and not names.protection.why_no_setting(known):
                yield entry
