"""Seeded faults that single unit tests have to find: ``python -m tests.support.seeded TABLE``.

Each fault is an edit of one function's body or of a module's constant. It goes into the running program, in a
process of its own that has been forked from one with everything imported: the tests that the table names
have to fail there. So a fault costs what its tests cost.
"""

from __future__ import annotations

import importlib
import os
import resource
import signal
import sys
import tomllib
from collections.abc import Iterator
from contextlib import redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Final

import pytest
from _pytest.runner import runtestprotocol

from bridge import mapping
from bridge.mapping.loader import family_names
from tests.proof.mutants import Edit
from tests.support.process import REPOSITORY

_MOST_S: Final = 5
"""Processor time; tests that need more with a fault have noticed it: it is in a loop without an end. With any
other fault they are done within a second."""
_OPTIONS: Final = ("-q", "-s", "-p", "no:cacheprovider", "-p", "no:xdist", "--tb=native", "--assert=plain")
"""Nobody reads what a test says that fails as it should, and that would take longer than the test."""
_PLAIN: Final = (bool, int, float, str, tuple, frozenset)
_FAILED, _BROKEN, _SAME = 1, 98, 99
_FOUND: Final = (_FAILED, -signal.SIGXCPU, -signal.SIGKILL)


@dataclass(frozen=True, slots=True)
class Seeded:
    """``edit`` is of a file below ``bridge/``; one of ``tests``, by their pytest ids, has to fail with it."""

    name: str
    edit: Edit
    tests: tuple[str, ...]

    @property
    def module(self) -> str:
        return "bridge." + self.edit.file.removesuffix(".py").replace("/", ".")

    def source(self) -> str:
        """The file with the fault. Raises ``ValueError`` where its place is not there."""
        return self.edit.apply((REPOSITORY / "bridge" / self.edit.file).read_text(encoding="utf-8"))


def load(path: Path) -> tuple[Seeded, ...]:
    """A table has for each file the folder or file of its tests, and the faults."""
    found: list[Seeded] = []
    for part in tomllib.loads(path.read_text(encoding="utf-8"))["file"]:
        for fault in part["fault"]:
            tests = tuple(f"{part['tests']}/{test}" for test in fault["tests"])
            edit = Edit(part["file"], fault["find"], fault["replace"])
            found.append(Seeded(fault["name"], edit, tests))
    return tuple(found)


def seed(module: ModuleType, source: str) -> int:
    """Put functions and plain constants of ``source`` into the module that is in use; how many differ."""
    changed = ModuleType(module.__name__)
    changed.__file__ = module.__file__
    sys.modules[module.__name__], held = changed, sys.modules[module.__name__]
    try:
        exec(compile(source, str(module.__file__), "exec"), changed.__dict__)
    finally:
        sys.modules[module.__name__] = held
    old, new = dict(_functions(module)), dict(_functions(changed))
    count = 0
    for name, function in new.items():
        if name in old and _differ(old[name], function):
            old[name].__code__ = function.__code__
            old[name].__defaults__ = function.__defaults__
            count += 1
    for name, value in vars(changed).items():
        # Members of an enumeration of the module itself are others in the copy, with the same text.
        is_plain = isinstance(value, _PLAIN) and not name.startswith("__")
        if is_plain and repr(vars(module)[name]) != repr(value):
            setattr(module, name, value)
            count += 1
    return count


def _differ(one: FunctionType, other: FunctionType) -> bool:
    codes = one.__code__, other.__code__
    return codes[0].replace(co_firstlineno=0) != codes[1].replace(co_firstlineno=0)


def _functions(module: ModuleType) -> Iterator[tuple[str, FunctionType]]:
    owners = [value for value in vars(module).values() if isinstance(value, type)]
    for owner in (module, *(one for one in owners if one.__module__ == module.__name__)):
        for held in vars(owner).values():
            for one in (held, getattr(held, "fget", None), getattr(held, "__func__", None)):
                if isinstance(one, FunctionType) and one.__module__ == module.__name__:
                    yield one.__qualname__, one


class _Loop:
    """Replacement of pytest's own loop: each fault has a process of its own, with tests that are
    collected."""

    def __init__(self, faults: tuple[Seeded, ...]) -> None:
        self._faults = faults
        self.lives: list[str] = []

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        for family in family_names():  # kept (conftest.py), so that not every process reads them
            mapping.load_family(family)
        every = tuple({test for fault in self._faults for test in fault.tests})
        if code := self._run(_chosen(session, every), None):
            self.lives.append(f"the tests end with {code} on the program as it is")
            return True
        for fault in self._faults:
            code = self._run(_chosen(session, fault.tests), fault)
            if code not in _FOUND:
                what = {0: "no test notices", _SAME: "changes nothing"}.get(code, f"ends with {code}")
                self.lives.append(f"{fault.name}: {what}")
        return True

    def _run(self, items: list[pytest.Item], fault: Seeded | None) -> int:
        pid = os.fork()
        if pid:
            return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
        code = _BROKEN
        try:
            nothing = os.open(os.devnull, os.O_RDWR)
            for stream in (0, 1, 2):
                os.dup2(nothing, stream)
            code = _outcome(items, fault)
        finally:
            os._exit(code)


def _chosen(session: pytest.Session, tests: tuple[str, ...]) -> list[pytest.Item]:
    """The items of these files and functions, with all their parameters."""
    return [
        item
        for item in session.items
        if any(item.nodeid == test or item.nodeid.startswith((f"{test}[", f"{test}::")) for test in tests)
    ]


def _outcome(items: list[pytest.Item], fault: Seeded | None) -> int:
    if not items:
        return _BROKEN
    if fault is not None:
        resource.setrlimit(resource.RLIMIT_CPU, (_MOST_S, _MOST_S + 1))
        if not seed(importlib.import_module(fault.module), fault.source()):
            return _SAME
    for place, item in enumerate(items):
        following = items[place + 1] if place + 1 < len(items) else None
        if any(report.failed for report in runtestprotocol(item, log=False, nextitem=following)):
            return _FAILED
    return 0


def main() -> int:
    """Print the faults that live. Exit code 1 where there is one."""
    os.chdir(REPOSITORY)
    os.environ["LANDING"] = "1"  # tests that the table names are asked whichever part of them runs by day
    faults = load(Path(sys.argv[1]))
    for fault in faults:
        importlib.import_module(fault.module)
    loop = _Loop(faults)
    tests = sorted({test.partition("::")[0] for fault in faults for test in fault.tests})
    with redirect_stdout(StringIO()):
        code = pytest.main([*_OPTIONS, *tests], [loop])
    if code:
        loop.lives.append(f"the tests cannot be collected: {code}")
    print("\n".join(loop.lives), end="\n" if loop.lives else "")
    return bool(loop.lives)


if __name__ == "__main__":
    sys.exit(main())
