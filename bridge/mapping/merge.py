"""A mapping file merged over those it extends, which still knows where each of its keys stands.

Tables are merged key by key. The lists ``value``, ``parameter``, ``poll``, ``slot``, ``input``,
``own_supervision`` and ``fault`` are merged item by item, by ``name`` (values by ``group`` too), ``meaning``
by ``word`` and ``group``, the PDOs of a slot by ``number``; every other list is replaced. ``without`` leaves
items of those lists out first. A parameter that gets another title, or other states, loses the German of the
former ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final, cast

from bridge.base.errors import Fault, FileFaults
from bridge.text import Said, Text
from bridge.tomlfile import Key, TomlFile
from bridge.tomlfile.file import Model, dotted, validated

_BY_NAME: Final = {
    "value": ("name", "group"),
    "meaning": ("word", "group"),
    **dict.fromkeys(("parameter", "poll", "slot", "input", "own_supervision", "fault"), ("name",)),
}
_PDOS: Final = ("rpdo", "tpdo")
_GERMAN: Final = {"title": "german", "states": "german_states"}
_Place = tuple[TomlFile, Key]


class MergedFile:
    """Merger of ``files``, in the order in which they are laid over each other, the extended one first."""

    def __init__(self, files: Sequence[TomlFile]) -> None:
        self._last = files[-1]
        self._places: dict[Key, _Place] = {}
        self.faults: list[Fault] = []
        self.data: dict[str, Any] = {}
        for file in files:
            self._forget_own()
            self._leave_out(file)
            self.data = self._table(self.data, file.data, (), (), file)

    @property
    def path(self) -> Path:
        return self._last.path

    def _forget_own(self) -> None:
        """Drop the file's own keys, which are not inherited: what it extends and leaves out, and that it is a
        template or preferred."""
        self.data.pop("extends", None)
        self.data.pop("without", None)
        family = self.data.get("family")
        if isinstance(family, dict):
            self.data["family"] = {**cast("dict[str, Any]", family)}
            self.data["family"].pop("template", None)
            self.data["family"].pop("preferred", None)

    def _leave_out(self, file: TomlFile) -> None:
        """Remove from what ``file`` extends what it is ``without``."""
        without: object = file.data.get("without")
        for n, entry in enumerate(cast("list[object]", without) if isinstance(without, list) else []):
            if not isinstance(entry, str):
                continue  # the model tells
            kind, _, name = entry.partition(":")
            known = [_label(item, kind) for item in self._items(kind)]
            if kind in _BY_NAME and name in known:
                self._remove(kind, known.index(name))
                continue
            key: Key = ("without", n)
            said = Text.of("mapping.not_extended", entry=entry)
            names = tuple(name for name in known if name)
            hint = (
                Text.of("mapping.known", names=names)
                if names
                else Text.of("mapping.without_form", kinds=tuple(_BY_NAME))
            )
            self.faults.append(Fault(str(file.path), file.line(key), dotted(key), said, hint))

    def _items(self, kind: str) -> list[Any]:
        items: object = self.data.get(kind) if kind in _BY_NAME else None
        return cast("list[Any]", items) if isinstance(items, list) else []

    def _remove(self, kind: str, place: int) -> None:
        """Remove one item of a list; those behind it move up."""
        items = self._items(kind)
        self.data = {**self.data, kind: items[:place] + items[place + 1 :]}
        self._drop((kind, place))
        for n in range(place + 1, len(items)):
            self._move((kind, n), (kind, n - 1))

    def _put(self, value: Any, at: Key, source: Key, file: TomlFile) -> Any:
        """Copy of ``value``, all of it noted as from ``file``."""
        self._places[at] = (file, source)
        if isinstance(value, dict):
            items = cast("dict[str, Any]", value).items()
            return {name: self._put(item, (*at, name), (*source, name), file) for name, item in items}
        if isinstance(value, list):
            listed = enumerate(cast("list[Any]", value))
            return [self._put(item, (*at, n), (*source, n), file) for n, item in listed]
        return value

    def _drop(self, at: Key) -> None:
        """Forget the places at and below ``at``: it is replaced."""
        for key in [key for key in self._places if key[: len(at)] == at]:
            del self._places[key]

    def _move(self, at: Key, to: Key) -> None:
        """Move the places at and below ``at`` to ``to``."""
        for key in [key for key in self._places if key[: len(at)] == at]:
            self._places[(*to, *key[len(at) :])] = self._places.pop(key)

    def _table(
        self, base: dict[str, Any], over: dict[str, Any], at: Key, source: Key, file: TomlFile
    ) -> dict[str, Any]:
        """Table ``over``, which is ``source`` of ``file``, laid over ``base``, which is ``at`` of ours."""
        if at:
            self._places[at] = (file, source)
        merged = dict(base)
        for name, value in over.items():
            here, there = (*at, name), (*source, name)
            have = base.get(name)
            if isinstance(have, dict) and isinstance(value, dict):
                tables = cast("tuple[dict[str, Any], dict[str, Any]]", (have, value))
                merged[name] = self._table(*tables, here, there, file)
            elif not at and name in _BY_NAME and isinstance(have, list) and isinstance(value, list):
                lists = cast("tuple[list[Any], list[Any]]", (have, value))
                merged[name] = self._named(*lists, name, file)
            elif len(at) == 2 and at[0] == "slot" and name in _PDOS and _same_pdos(have, value):
                merged[name] = self._pdos(have, value, here, there, file)
            else:
                self._drop(here)
                merged[name] = self._put(value, here, there, file)
        return merged

    def _named(self, base: list[Any], over: list[Any], name: str, file: TomlFile) -> list[Any]:
        """Lists of tables merged by name. An item without a name, or with one that its own file has given
        before, is an item of its own: the checks report doubles."""
        merged = list(base)
        places = {_identity(item, name): n for n, item in enumerate(base)}
        for n, item in enumerate(over):
            place = places.pop(_identity(item, name), None)
            if place is None:
                merged.append(self._put(item, (name, len(merged)), (name, n), file))
            else:
                kept = self._without_german(merged[place], item, (name, place))
                merged[place] = self._table(kept, item, (name, place), (name, n), file)
        return merged

    def _without_german(self, base: dict[str, Any], over: dict[str, Any], at: Key) -> dict[str, Any]:
        """Table of a parameter without the German of what ``over`` says anew."""
        gone = [german for english, german in _GERMAN.items() if at[0] == "parameter" and english in over]
        for german in gone:
            self._drop((*at, german))
        return {name: value for name, value in base.items() if name not in gone}

    def _pdos(self, base: Any, over: Any, here: Key, there: Key, file: TomlFile) -> list[Any]:
        """PDOs merged by number; one without a number is the first."""
        if isinstance(base, dict):
            place = self._places.get(here)
            self._move(here, (*here, 0))
            if place:
                self._places[here] = place
        merged = _listed(base)
        numbers = _numbers(merged)
        for n, item in enumerate(_listed(over)):
            source = (*there, n) if isinstance(over, list) else there
            place_of = _place_in(item, numbers)
            if place_of is None:
                merged.append(self._put(item, (*here, len(merged)), source, file))
            else:
                numbers[place_of] = None
                merged[place_of] = self._table(merged[place_of], item, (*here, place_of), source, file)
        return merged

    def place(self, key: Sequence[int | str]) -> _Place:
        """File in which ``key`` stands, or the nearest table around it, and its key there."""
        for length in range(len(key), 0, -1):
            place = self._places.get(tuple(key[:length]))
            if place:
                return place[0], (*place[1], *key[length:])
        return self._last, tuple(key)

    def item(self, key: Key, place: int) -> Key:
        """Key of one of several items that may be written as one table."""
        return (*key, place) if (*key, place) in self._places else key

    def line(self, key: Sequence[int | str]) -> int:
        file, source = self.place(key)
        return file.line(source)

    def fault(self, key: Sequence[int | str], said: Text, hint: Said = "") -> None:
        file, source = self.place(key)
        self.faults.append(Fault(str(file.path), file.line(source), dotted(source), said, hint))

    def validate(self, model: type[Model]) -> Model | None:
        """Content as ``model``, or None with every fault noted."""
        return validated(self.data, model, self.fault)

    def finish(self) -> None:
        """Raise ``FileFaults`` if any fault was noted, those of the last file first."""
        own = str(self._last.path)
        if self.faults:
            raise FileFaults(sorted(self.faults, key=lambda fault: (fault.file != own, fault.line)))


def _identity(item: Any, name: str) -> object:
    """Key that tells an item of the list ``name`` from the others; its id where it names none."""
    if not isinstance(item, dict):
        return id(item)
    table = cast("dict[str, Any]", item)
    values = tuple(table.get(key) for key in _BY_NAME[name])
    return id(table) if None in values or not all(isinstance(value, str) for value in values) else values


def _label(item: Any, kind: str) -> str:
    """Name that ``without`` uses for an item of the list ``kind``; empty where it has none."""
    identity = _identity(item, kind)
    return "/".join(reversed(cast("tuple[str, ...]", identity))) if isinstance(identity, tuple) else ""


def _listed(pdos: Any) -> list[Any]:
    """List of PDOs; one table stands for a list of one."""
    return list(cast("list[Any]", pdos)) if isinstance(pdos, list) else [pdos]


def _numbers(pdos: list[Any]) -> list[object]:
    return [cast("dict[str, object]", pdo).get("number") if isinstance(pdo, dict) else None for pdo in pdos]


def _place_in(pdo: Any, numbers: list[object]) -> int | None:
    """Index of the PDO that this one changes; None where it is a further one."""
    if not isinstance(pdo, dict):
        return None
    number = cast("dict[str, object]", pdo).get("number")
    if number is None:
        return 0 if numbers and numbers[0] is not None else None
    return numbers.index(number) if number in numbers else None


def _same_pdos(base: Any, over: Any) -> bool:
    """Whether one of them changes a PDO that is there; else they replace those."""
    numbers = _numbers(_listed(base))
    return any(_place_in(pdo, numbers) is not None for pdo in _listed(over))
