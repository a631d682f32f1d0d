"""TOML files that people write: read, checked against a model, every fault with its line."""

from __future__ import annotations

import codecs
import re
import tomllib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final, TypeVar, cast

from pydantic import BaseModel, ValidationError

from bridge.base.errors import Fault, FileFaults
from bridge.text import Said, Text
from bridge.tomlfile.lines import Key, key_lines
from bridge.tomlfile.messages import explain

Model = TypeVar("Model", bound=BaseModel)

_DECIMAL_COMMA: Final = re.compile(r"=\s*[-+]?([0-9]+),([0-9]+)")
_SYNTAX_PLACE: Final = re.compile(r" \(at (?:line (\d+), column \d+|end of document)\)")


@dataclass(frozen=True, slots=True)
class RawTable:
    """A table as it is in the file, not checked: what does not fit counts as missing."""

    key: Key
    content: dict[str, Any]

    def text(self, name: str) -> str | None:
        value = self.content.get(name)
        return value if isinstance(value, str) else None

    def whole(self, name: str) -> int | None:
        value = self.content.get(name)
        return value if isinstance(value, int) and not isinstance(value, bool) else None

    def table(self, name: str) -> RawTable:
        """The table ``name``; empty where it is not there."""
        value = self.content.get(name)
        content = cast("dict[str, Any]", value) if isinstance(value, dict) else {}
        return RawTable((*self.key, name), content)

    def tables(self, name: str) -> Iterator[RawTable]:
        """The tables of the list ``name``."""
        items = self.content.get(name)
        if not isinstance(items, list):
            return
        for position, item in enumerate(cast("list[object]", items)):
            if isinstance(item, dict):
                yield RawTable((*self.key, name, position), cast("dict[str, Any]", item))


class TomlFile:
    """A parsed TOML file that knows on which line each of its keys stands."""

    def __init__(self, path: Path, text: str | None = None) -> None:
        """``text`` is what was made of the file in ``path``. Raises ``FileFaults`` where the file cannot be
        read or is not TOML."""
        self.path = path
        self.faults: list[Fault] = []
        text = self.text = self._read() if text is None else text
        try:
            self.data: dict[str, Any] = tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            place = _SYNTAX_PLACE.search(str(error))
            line = int(place[1]) if place and place[1] else text.rstrip("\n").count("\n") + 1
            message = _SYNTAX_PLACE.sub("", str(error))
            raise self._unreadable(line, Text.of("toml.syntax", why=message), _hint(text, line)) from error
        except RecursionError as error:
            raise self._unreadable(0, Text.of("toml.nested")) from error
        except ValueError as error:  # a number of more digits than Python reads
            raise self._unreadable(0, Text.of("toml.unreadable", why=str(error))) from error

    @cached_property
    def _lines(self) -> dict[Key, int]:
        """Only a fault needs them, and most files have none."""
        return key_lines(self.text)

    def _read(self) -> str:
        try:
            content = self.path.read_bytes()
        except OSError as error:
            raise self._unreadable(0, Text.of("toml.unreadable", why=str(error.strerror))) from error
        try:
            content = content.removeprefix(codecs.BOM_UTF8)
            return content.decode().replace("\r\n", "\n")
        except UnicodeDecodeError as error:
            line = content[: error.start].count(b"\n") + 1
            raise self._unreadable(line, Text.of("toml.not_utf8"), Text.of("toml.save_as_utf8")) from error

    def _unreadable(self, line: int, message: Text, hint: Said = "") -> FileFaults:
        return FileFaults([Fault(str(self.path), line, "", message, hint)])

    @property
    def root(self) -> RawTable:
        return RawTable((), self.data)

    def line(self, key: Sequence[int | str]) -> int:
        """The line of ``key``, or of the nearest table around it; 0 if the file has neither."""
        for length in range(len(key), 0, -1):
            line = self._lines.get(tuple(key[:length]))
            if line:
                return line
        return 0

    def fault(self, key: Sequence[int | str], said: Text, hint: Said = "") -> None:
        """Note a fault; ``finish`` raises them all."""
        self.faults.append(Fault(str(self.path), self.line(key), dotted(key), said, hint))

    def validate(self, model: type[Model]) -> Model | None:
        """The file's content as ``model``, or None with every fault noted."""
        return validated(self.data, model, self.fault)

    def finish(self) -> None:
        """Raise ``FileFaults`` if any fault was noted."""
        if self.faults:
            raise FileFaults(sorted(self.faults, key=lambda fault: fault.line))


def dotted(key: Sequence[int | str]) -> str:
    """``("bus", 0, "node", 1, "id")`` as ``bus[0].node[1].id``."""
    text = ""
    for part in key:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else part
    return text


def validated(
    data: dict[str, Any], model: type[Model], fault: Callable[[Key, Text, Said], None]
) -> Model | None:
    """``data`` as ``model``, or None with every ``fault`` noted."""
    try:
        return model.model_validate(data)
    except ValidationError as error:
        for detail in error.errors(include_url=False):
            fault(_real_key(data, detail["loc"]), *explain(model, detail))
        return None


def _real_key(data: Any, location: Sequence[int | str]) -> Key:
    """``location`` without the tags that pydantic adds for unions: only what is in the file."""
    key: list[int | str] = []
    here = data
    for position, part in enumerate(location):
        last = position == len(location) - 1
        if isinstance(here, dict):
            table = cast("dict[str, Any]", here)
            if part not in table and not last:
                continue
            key.append(part)
            here = table.get(str(part))
        elif isinstance(here, list) and isinstance(part, int):
            items = cast("list[Any]", here)
            key.append(part)
            here = items[part] if part < len(items) else None
    return tuple(key)


def _hint(text: str, line: int) -> Said:
    found = _DECIMAL_COMMA.search(next(iter(text.split("\n")[line - 1 : line]), ""))
    return Text.of("toml.decimal_point", whole=found[1], rest=found[2]) if found else ""
