"""TOML files that people write: read, checked against a model, every fault with its line."""

from __future__ import annotations

import difflib
import re
import tomllib
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Final, TypeVar, cast, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from bridge.errors import Fault, FileFaults

Key = tuple[int | str, ...]
Model = TypeVar("Model", bound=BaseModel)

_HEADER: Final = re.compile(r"^\s*(\[\[?)\s*([^\[\]]+?)\s*\]\]?\s*(?:#.*)?$")
_ASSIGNMENT: Final = re.compile(r"^\s*([A-Za-z0-9_.\-\"']+)\s*=")
_SYNTAX_PLACE: Final = re.compile(r"\(at line (\d+), column \d+\)")
_INLINE_KEY: Final = re.compile(r"[A-Za-z0-9_\-]+(?=\s*=)")


class TomlFile:
    """A parsed TOML file that knows on which line each of its keys stands."""

    def __init__(self, path: Path) -> None:
        """Raises ``FileFaults`` where the file cannot be read or is not TOML."""
        self.path = path
        self.faults: list[Fault] = []
        try:
            self.text = path.read_text(encoding="utf-8-sig")
        except OSError as error:
            raise FileFaults([Fault(str(path), 0, "", f"cannot be read: {error.strerror}")]) from error
        except UnicodeDecodeError as error:
            line = path.read_bytes()[: error.start].count(b"\n") + 1
            raise FileFaults([Fault(str(path), line, "", "is not UTF-8", "save it as UTF-8")]) from error
        try:
            self.data: dict[str, Any] = tomllib.loads(self.text)
        except tomllib.TOMLDecodeError as error:
            place = _SYNTAX_PLACE.search(str(error))
            line = int(place[1]) if place else self.text.count("\n") + 1
            message = _SYNTAX_PLACE.sub("", str(error)).strip()
            raise FileFaults([Fault(str(path), line, "", f"is not TOML: {message}")]) from error
        self._lines = dict(_key_lines(self.text))

    def line(self, key: Sequence[int | str]) -> int:
        """The line of ``key``, or of the nearest table around it; 0 where nothing of it is written."""
        for length in range(len(key), 0, -1):
            line = self._lines.get(tuple(key[:length]))
            if line:
                return line
        return 0

    def fault(self, key: Sequence[int | str], message: str, hint: str = "") -> None:
        """Note a fault; ``finish`` raises them all."""
        self.faults.append(Fault(str(self.path), self.line(key), dotted(key), message, hint))

    def validate(self, model: type[Model]) -> Model | None:
        """The file's content as ``model``, or None with every fault noted."""
        try:
            return model.model_validate(self.data)
        except ValidationError as error:
            for detail in error.errors(include_url=False):
                self._note(model, detail)
            return None

    def finish(self) -> None:
        """Raise ``FileFaults`` if any fault was noted."""
        if self.faults:
            raise FileFaults(sorted(self.faults, key=lambda fault: fault.line))

    def _note(self, model: type[BaseModel], detail: ErrorDetails) -> None:
        key = _real_key(self.data, detail["loc"])
        message = detail["msg"].removeprefix("Value error, ").removeprefix("Assertion failed, ")
        hint = ""
        if detail["type"] == "extra_forbidden":
            message = "is not a key that belongs here"
            names = _sibling_names(model, detail["loc"])
            near = difflib.get_close_matches(str(detail["loc"][-1]), names, n=1)
            hint = f"did you mean {near[0]}?" if near else f"known here: {', '.join(sorted(names))}"
        elif detail["type"] == "missing":
            message = "is missing"
            hint = _description(model, detail["loc"])
        else:
            hint = _description(model, detail["loc"])
            given = detail.get("input")
            if isinstance(given, str | int | float | bool):
                message = f"{message[0].lower()}{message[1:]}, not {given!r}"
        self.fault(key, message, hint)


def dotted(key: Sequence[int | str]) -> str:
    """``("bus", 0, "node", 1, "id")`` as ``bus[0].node[1].id``."""
    text = ""
    for part in key:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else part
    return text


def _key_lines(text: str) -> Iterable[tuple[Key, int]]:
    """Each key of the file with its line; arrays of tables count as tomllib counts them."""
    counts: dict[Key, int] = {}
    table: Key = ()
    for number, line in enumerate(text.splitlines(), 1):
        header = _HEADER.match(line)
        if header:
            table = _open_table(header[2], header[1] == "[[", counts)
            yield table, number
            continue
        assignment = _ASSIGNMENT.match(line)
        if assignment:
            key = (*table, *_split(assignment[1]))
            yield key, number
            for inner in _INLINE_KEY.findall(line[assignment.end() :]):
                yield (*key, inner), number


def _open_table(name: str, is_array: bool, counts: dict[Key, int]) -> Key:
    parts = _split(name)
    key: Key = ()
    for position, part in enumerate(parts):
        key = (*key, part)
        if is_array and position == len(parts) - 1:
            counts[key] = counts.get(key, -1) + 1
        if key in counts:
            key = (*key, counts[key])
    return key


def _split(name: str) -> tuple[str, ...]:
    return tuple(part.strip().strip("\"'") for part in name.split("."))


def _real_key(data: Any, location: Sequence[int | str]) -> Key:
    """``location`` without the tags pydantic adds for unions: only what stands in the file."""
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


def _submodel(annotation: Any) -> type[BaseModel] | None:
    """The model inside an annotation such as ``list[Node] | None``."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for argument in get_args(annotation):
        found = _submodel(argument)
        if found:
            return found
    return None


def _owner(model: type[BaseModel], location: Sequence[int | str]) -> type[BaseModel] | None:
    here: type[BaseModel] | None = model
    for part in location[:-1]:
        if here is None or not isinstance(part, str):
            continue
        by_alias = {field.alias or name: field for name, field in here.model_fields.items()}
        if part in by_alias:
            here = _submodel(by_alias[part].annotation)
    return here


def _sibling_names(model: type[BaseModel], location: Sequence[int | str]) -> list[str]:
    owner = _owner(model, location)
    return [field.alias or name for name, field in owner.model_fields.items()] if owner else []


def _description(model: type[BaseModel], location: Sequence[int | str]) -> str:
    owner = _owner(model, location)
    if owner is None or not location:
        return ""
    for name, field in owner.model_fields.items():
        if (field.alias or name) == location[-1]:
            return field.description or ""
    return ""
