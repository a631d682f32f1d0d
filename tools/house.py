#!/usr/bin/env python3
"""Print what is measured of the code: how its rooms lie, and what is found in too many of them.

    .venv/bin/python -m tools.house

Every row is counted in the syntax of the files below bridge/, so that anybody gets the same numbers.
"""

from __future__ import annotations

import ast
import json
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).resolve().parents[1]
_PHRASES: Final = "bridge/northbound/page/static/js/texts/said-*.json"
_OWN_FILES: Final = ("__init__", "__main__")
_LOOKED_FOR: Final = frozenset(("device", "outputs", "is_device"))
_TELLS: Final = ("set", "report", "count")
_CORES: Final = ("bridge.command", "bridge.node", "bridge.master")


@dataclass(frozen=True)
class Row:
    """What is measured, how much of it there is, and how much is wanted."""

    what: str
    now: str
    wanted: str


class House:
    """The Python files below ``root``/bridge, by their names in dots."""

    def __init__(self, root: Path) -> None:
        self._root = root
        self._files = {
            _dotted(file.relative_to(root)): file for file in sorted((root / "bridge").rglob("*.py"))
        }
        self._trees = {
            name: ast.parse(file.read_text(encoding="utf-8")) for name, file in self._files.items()
        }

    def rows(self) -> Iterator[Row]:
        phrases = self.phrases()
        yield Row("sentences matched to be translated, with slots", f"{phrases[0]}, {phrases[1]}", "0")
        yield Row("attributes of the stop check of a drive", _shown(self.attributes("DriveStopCheck")), "5")
        yield Row("calls node and master → plant", f"{self.calls_of_plant()}", "0")
        yield Row("callables given to constructors of cores", f"{len(self.callables_taken())}", "at most 19")
        yield Row("files that name Plant", f"{len(self.naming('Plant'))}", "at most 12")
        yield Row("parameters of Drive.__init__", _shown(self.parameters("Drive")), "at most 6")
        yield Row("lines of Plant.__init__", _shown(self.lines("Plant")), "at most 30")
        yield Row("files with device or outputs branches", f"{len(self.with_branches())}", "at most 12")
        yield Row("loose modules in bridge/", f"{len(self.loose())}", "at most 2")
        yield Row("import circles", f"{len(self.circles())}", "0")
        yield Row("class names in several modules", f"{len(self.repeated_classes())}", "at most 20")
        yield Row("module names used twice", f"{len(self.repeated_modules())}", "at most 15")
        twins = self.with_twins()
        yield Row(
            "files whose test is at the mirrored path", f"{len(twins)} of {len(self.tested)}", "90 % or more"
        )

    def phrases(self) -> tuple[int, int]:
        """How many there are, and how many of them have slots."""
        books = [json.loads(file.read_text(encoding="utf-8")) for file in self._root.glob(_PHRASES)]
        pairs = [pair for book in books for pair in book]
        return len(pairs), sum("{" in pair[0] for pair in pairs)

    def attributes(self, name: str) -> int | None:
        """Attributes that a class gives itself; None where there is no such class."""
        found = self._class(name)
        if found is None:
            return None
        targets = (node for node in ast.walk(found) if isinstance(node, ast.Attribute))
        stored = (node for node in targets if isinstance(node.ctx, ast.Store))
        return len(
            {node.attr for node in stored if isinstance(node.value, ast.Name) and node.value.id == "self"}
        )

    def parameters(self, name: str) -> int | None:
        made = self._init(name)
        return None if made is None else len([*made.args.args, *made.args.kwonlyargs]) - 1

    def lines(self, name: str) -> int | None:
        made = self._init(name)
        return None if made is None else (made.end_lineno or made.lineno) - made.lineno + 1

    def calls_of_plant(self) -> int:
        """Calls by which a node or the master changes the plant."""

        def is_call(node: ast.AST) -> bool:
            if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)):
                return False
            told = node.func.attr in _TELLS or node.func.attr.startswith("on_")
            return told and ast.unparse(node.func.value).endswith("plant")

        below = (name for name in self._trees if name.startswith(("bridge.node", "bridge.master")))
        return sum(is_call(node) for name in below for node in ast.walk(self._trees[name]))

    def callables_taken(self) -> list[str]:
        """Parameters by which constructors in command, node and master take something to be called, as
        ``Class.parameter``; fields of data classes and named tuples count."""
        trees = [tree for name, tree in self._trees.items() if name.startswith(_CORES)]
        names = {"Callable", *(alias for tree in trees for alias in _callable_aliases(tree))}
        classes = [node for tree in trees for node in tree.body if isinstance(node, ast.ClassDef)]
        return sorted(
            f"{one.name}.{parameter}"
            for one in classes
            for parameter, kind in _constructed_with(one)
            if any(isinstance(node, ast.Name) and node.id in names for node in ast.walk(kind))
        )

    def naming(self, word: str) -> list[str]:
        """Modules in which a name stands."""
        return self._with(lambda node: isinstance(node, ast.Name) and node.id == word)

    def with_branches(self) -> list[str]:
        """Modules outside the simulator that look whether something is a device, or at its outputs."""
        found = self._with(lambda node: isinstance(node, ast.Attribute) and node.attr in _LOOKED_FOR)
        return [name for name in found if not name.startswith("bridge.sim")]

    def loose(self) -> list[str]:
        """Modules that are in no room."""
        names = [
            name.removeprefix("bridge.") for name, file in self._files.items() if file.parent.name == "bridge"
        ]
        return [name for name in names if name not in ("bridge", *_OWN_FILES)]

    def circles(self) -> list[set[str]]:
        """Modules that need each other, also for types alone."""
        return circles(self._imports)

    def repeated_classes(self) -> list[str]:
        places: dict[str, set[str]] = defaultdict(set)
        for name, tree in self._trees.items():
            for node in tree.body:
                if isinstance(node, ast.ClassDef):
                    places[node.name].add(name)
        return sorted(name for name, modules in places.items() if len(modules) > 1)

    def repeated_modules(self) -> list[str]:
        places: dict[str, int] = defaultdict(int)
        for file in self._files.values():
            if file.stem not in _OWN_FILES:
                places[file.stem] += 1
        return sorted(name for name, count in places.items() if count > 1)

    @cached_property
    def tested(self) -> list[Path]:
        """Files with code of their own."""
        return [file for file in self._files.values() if file.stem not in _OWN_FILES]

    def with_twins(self) -> list[Path]:
        """Files whose test stands at the same path below tests/unit."""

        def twin(file: Path) -> Path:
            place = file.relative_to(self._root / "bridge").parent
            return self._root / "tests" / "unit" / place / f"test_{file.name}"

        return [file for file in self.tested if twin(file).is_file()]

    @cached_property
    def _imports(self) -> dict[str, set[str]]:
        return {name: {*self._needed(name)} - {name} for name in self._trees}

    def _needed(self, name: str) -> Iterator[str]:
        for node in ast.walk(self._trees[name]):
            if isinstance(node, ast.Import):
                yield from (one.name for one in node.names if one.name in self._trees)
            elif isinstance(node, ast.ImportFrom) and node.module in self._trees:
                for one in node.names:
                    whole = f"{node.module}.{one.name}"
                    yield whole if whole in self._trees else node.module

    def _with(self, has: Callable[[ast.AST], bool]) -> list[str]:
        return [name for name, tree in self._trees.items() if any(has(node) for node in ast.walk(tree))]

    def _class(self, name: str) -> ast.ClassDef | None:
        nodes = (node for tree in self._trees.values() for node in tree.body)
        return next((one for one in nodes if isinstance(one, ast.ClassDef) and one.name == name), None)

    def _init(self, name: str) -> ast.FunctionDef | None:
        found = self._class(name)
        return None if found is None else _init_of(found)


def _init_of(found: ast.ClassDef) -> ast.FunctionDef | None:
    functions = (one for one in found.body if isinstance(one, ast.FunctionDef))
    return next((one for one in functions if one.name == "__init__"), None)


def _constructed_with(found: ast.ClassDef) -> Iterator[tuple[str, ast.expr]]:
    """Parameters of a constructor with their annotations, written or made from fields."""
    made = _init_of(found)
    if made is not None:
        parameters = (*made.args.args, *made.args.kwonlyargs)
        yield from ((one.arg, one.annotation) for one in parameters if one.annotation is not None)
    elif found.decorator_list or any(ast.unparse(base) == "NamedTuple" for base in found.bases):
        fields = (one for one in found.body if isinstance(one, ast.AnnAssign))
        yield from ((ast.unparse(one.target), one.annotation) for one in fields)


def _callable_aliases(tree: ast.Module) -> Iterator[str]:
    """Names that a module gives to kinds of callables."""
    for node in tree.body:
        if isinstance(node, ast.Assign) and ast.unparse(node.value).startswith("Callable["):
            yield from (ast.unparse(target) for target in node.targets)


def circles(needs: Mapping[str, set[str]]) -> list[set[str]]:
    """Groups in which each needs every other, over however many steps."""
    reached = {name: _reached(name, needs) for name in needs}
    found: list[set[str]] = []
    for name in needs:
        group = {other for other in reached[name] if name in reached[other]}
        if len(group) > 1 and group not in found:
            found.append(group)
    return found


def _reached(name: str, needs: Mapping[str, set[str]]) -> set[str]:
    seen: set[str] = set()
    ahead = [name]
    while ahead:
        for other in needs.get(ahead.pop(), set()) - seen:
            seen.add(other)
            ahead.append(other)
    return seen


def _dotted(file: Path) -> str:
    return ".".join(file.with_suffix("").parts).removesuffix(".__init__")


def _shown(count: int | None) -> str:
    return "there is none" if count is None else f"{count}"


if __name__ == "__main__":
    for row in House(ROOT).rows():
        print(f"{row.what:48} {row.now:>12}   wanted: {row.wanted}")
