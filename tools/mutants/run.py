"""Tests on a changed program, in processes forked from one that has imported everything but the program."""

from __future__ import annotations

import importlib
import os
import resource
import select
import signal
import sys
import time
from collections import Counter
from collections.abc import Callable, Generator
from contextlib import suppress
from dataclasses import dataclass, field
from importlib.machinery import SourceFileLoader
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from types import CodeType
from typing import Any, Final

import coverage
import pytest

from tools.mutants.find import Mutant

REPOSITORY: Final = Path(__file__).resolve().parents[2]
_ARGUMENTS: Final = ("-x", "-q", "-p", "no:cacheprovider", "-p", "no:xdist")
_QUICK_S: Final = 1.0
"""Tests of this long together run first: most mutants need no more."""
_BEGIN_S: Final = 0.02
"""What a test takes beside what it does itself."""
_LONGER: Final = 5.0
"""So many times as long as on the unchanged program, and ``_LEAST_S`` more, may the tests take: a mutant that
takes longer is noticed."""
_LEAST_S: Final = 8.0
_MOST_BYTES: Final = 4 << 30
_OURS: Final = ("bridge", "tests", "tools", "__main__", "__mp_main__")


@dataclass(slots=True)
class Recorded:
    """What tests run. ``lines``: which of them run each line of a file, "" for the import; ``modules``: what
    they import beside the program and themselves."""

    took_s: dict[str, float] = field(default_factory=dict[str, float])
    failed: list[str] = field(default_factory=list[str])
    lines: dict[str, dict[int, set[str]]] = field(default_factory=dict[str, dict[int, set[str]]])
    modules: set[str] = field(default_factory=set[str])
    much: Counter[str] = field(default_factory=Counter[str])
    """How many lines each test runs of all files, counted by ``add``."""

    def add(self, other: Recorded) -> None:
        self.took_s |= other.took_s
        self.failed += other.failed
        self.modules |= other.modules
        for path, lines in other.lines.items():
            mine = self.lines.setdefault(path, {})
            for line, tests in lines.items():
                known = mine.setdefault(line, set())
                self.much.update(tests - known)
                known |= tests

    def tests_of(self, mutant: Mutant) -> list[str]:
        """Those that run what is changed; of what is run by the import, all that run anything of the file,
        even if one of them was the first to import it, or of its folder where the import runs all of it.
        First the quick ones that run little beside that: they are about it."""
        lines = self.lines.get(str(mutant.path), {})
        runs = {test for line in range(mutant.statement, mutant.line + 1) for test in lines.get(line, ())}
        here = Counter(test for tests in lines.values() for test in tests)
        if "" in runs:
            if all("" in tests for tests in lines.values()):
                paths = (path for path in self.lines if Path(path).parent == mutant.path.parent)
                here = Counter(
                    test for path in paths for tests in self.lines[path].values() for test in tests
                )
            runs = set(here)
        return sorted(
            runs - {""}, key=lambda test: (self.took_s[test] + _BEGIN_S) * self.much[test] / here[test]
        )


class _Recorder:
    """Notes what each test runs, and how long it takes."""

    def __init__(self, recorded: Recorded, coverage: coverage.Coverage) -> None:
        self._recorded = recorded
        self._coverage = coverage

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Generator[None, object, object]:
        self._coverage.switch_context(item.nodeid)
        begin = time.monotonic()
        try:
            return (yield)
        finally:
            self._recorded.took_s[item.nodeid] = time.monotonic() - begin

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed:
            self._recorded.failed.append(report.nodeid)


class _Chosen:
    """Only these tests, in this order."""

    def __init__(self, tests: list[str]) -> None:
        self._places = {test: place for place, test in enumerate(tests)}

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        items[:] = [item for item in items if item.nodeid in self._places]
        items.sort(key=lambda item: self._places[item.nodeid])


def record(sources: tuple[str, ...], tests: list[str]) -> Recorded:
    """Run these files of tests on the program as it is, and note what they run of the folders ``sources``."""
    reader, writer = Pipe(duplex=False)
    pid = _forked(lambda: _record(sources, tests, writer))
    writer.close()
    recorded = reader.recv()
    os.waitpid(pid, 0)
    assert isinstance(recorded, Recorded)
    return recorded


def _record(sources: tuple[str, ...], tests: list[str], writer: Connection) -> int:
    recorded = Recorded()
    covered = coverage.Coverage(data_file=None, source=sources, config_file=False)
    covered.start()
    code = pytest.main([*_ARGUMENTS, *tests], [_Recorder(recorded, covered)])
    covered.stop()
    if code and not recorded.failed:
        recorded.failed += tests
    data = covered.get_data()
    for path in data.measured_files():
        lines = {line: {*runs} for line, runs in data.contexts_by_lineno(path).items()}
        recorded.lines[str(Path(path).relative_to(REPOSITORY))] = lines
    recorded.modules = {name for name in sys.modules if name.partition(".")[0] not in _OURS}
    writer.send(recorded)
    return 0


def has_survived(mutant: Mutant, suite: Recorded, most_s: float) -> bool:
    """Whether none of the tests that run it notices; those that are left after ``most_s`` are not asked."""
    _import(suite.modules)
    total_s, quick, tests = 0.0, 0, suite.tests_of(mutant)
    for number, test in enumerate(tests):
        total_s += suite.took_s[test]
        if total_s <= _QUICK_S:
            quick = number + 1
        if total_s > most_s:
            tests = tests[: number + 1]
            break
    return all(_passes(mutant, some, suite) for some in (tests[:quick], tests[quick:]) if some)


def _import(modules: set[str]) -> None:
    for name in sorted(modules):
        if name not in sys.modules:
            with suppress(Exception):
                importlib.import_module(name)


def _passes(mutant: Mutant, tests: list[str], suite: Recorded) -> bool:
    paths = dict.fromkeys(test.partition("::")[0] for test in tests)

    def run() -> int:
        resource.setrlimit(resource.RLIMIT_AS, (_MOST_BYTES, _MOST_BYTES))
        _change(mutant)
        return pytest.main([*_ARGUMENTS, *paths], [_Chosen(tests)])

    limit_s = _LEAST_S + _LONGER * sum(suite.took_s[test] for test in tests)
    pid = _forked(run)
    end = os.pidfd_open(pid)
    has_ended, _, _ = select.select([end], [], [], limit_s)
    os.close(end)
    if not has_ended:
        os.killpg(pid, signal.SIGKILL)
    _, status = os.waitpid(pid, 0)
    code = os.waitstatus_to_exitcode(status)
    assert code != pytest.ExitCode.NO_TESTS_COLLECTED, mutant
    return code == 0


def _forked(run: Callable[[], int]) -> int:
    """The process in which it runs, in a group of its own, without a word."""
    pid = os.fork()
    if pid:
        with suppress(OSError):  # it has done so itself, and may even have ended
            os.setpgid(pid, pid)
        return pid
    code = 1
    try:
        os.setpgid(0, 0)
        os.chdir(REPOSITORY)
        nothing = os.open(os.devnull, os.O_RDWR)
        for stream in (0, 1, 2):
            os.dup2(nothing, stream)
        code = int(run())
    finally:
        os._exit(code)


def _change(mutant: Mutant) -> None:
    """Import the program with the change from now on."""
    changed = str(REPOSITORY / mutant.path)
    get_code: Any = SourceFileLoader.get_code

    def of(loader: SourceFileLoader, fullname: str) -> CodeType | None:
        if loader.path != changed:
            return get_code(loader, fullname)
        return compile(mutant.applied(Path(changed).read_bytes()), changed, "exec")

    SourceFileLoader.get_code = of
