"""Whether the unit tests notice small faults in the code: ``make mutants``.

    python -m tools.mutants [--jobs N] [--every N] [FILE_OR_FOLDER ...]

Each mutant is the program with one small change: a comparison, an operator, a constant, a call left out. The
unit tests of its room (``tests/unit/ROOM`` for ``bridge/ROOM``) run on it, the quickest file first, until one
test fails. Mutants that no test notices are printed: either a test is missing, or the change makes no
difference that anybody could see.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import islice
from pathlib import Path
from queue import Queue
from typing import Final

from tools.mutants.find import Mutant, find

REPOSITORY: Final = Path(__file__).resolve().parents[2]
ROOMS: Final = ("bridge/command", "bridge/canopen")
_COPIED: Final = ("bridge", "mappings", "tests", "tools", "docs", "deploy", "systemd", "pyproject.toml")
_LONGER: Final = 5.0
"""So many times as long as on the unchanged program may the tests take: more counts as noticed."""
_LEAST_LIMIT_S: Final = 30.0


class Tree:
    """A copy of the repository, in which one mutant at a time is tried."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        for name in _COPIED:
            source = REPOSITORY / name
            if source.is_dir():
                shutil.copytree(
                    source, folder / name, ignore=shutil.ignore_patterns("__pycache__", "node_modules")
                )
            else:
                shutil.copy(source, folder / name)
        # By their content: a mutant is as long as the original now and then, and as old.
        compiling = ("-m", "compileall", "-q", "--invalidation-mode", "checked-hash", "bridge", "tests")
        subprocess.run([sys.executable, *compiling], cwd=folder, check=True)

    def passes(self, tests: list[str], limit_s: float | None = None) -> bool:
        """Raises ``TimeoutExpired`` where they take longer."""
        command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *tests]
        environment = os.environ | {"PYTHONDONTWRITEBYTECODE": "1", "HYPOTHESIS_DATABASE": ""}
        with subprocess.Popen(
            command,
            cwd=self._folder,
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            process_group=0,
        ) as process:
            try:
                return process.wait(limit_s) == 0
            finally:
                if process.poll() is None:
                    os.killpg(process.pid, 9)

    def survives(self, mutant: Mutant, tests: list[str], limit_s: float) -> bool:
        path = self._folder / mutant.path
        source = path.read_bytes()
        path.write_bytes(mutant.applied(source))
        try:
            return self.passes(tests, limit_s)
        except subprocess.TimeoutExpired:
            return False
        finally:
            path.write_bytes(source)


def tests_of(room: str, tree: Tree) -> tuple[list[str], float]:
    """The test files of a room, the quickest first, and how long all of them take in seconds."""
    took_s: dict[str, float] = {}
    for path in sorted((REPOSITORY / "tests" / "unit" / room).rglob("test_*.py")):
        name = str(path.relative_to(REPOSITORY))
        begin = time.monotonic()
        if not tree.passes([name]):
            sys.exit(f"{name} fails on the program as it is")
        took_s[name] = time.monotonic() - begin
    return sorted(took_s, key=lambda name: took_s[name]), sum(took_s.values())


def files(asked: list[str]) -> Iterator[Path]:
    for name in asked:
        path = (REPOSITORY / name).resolve()
        for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
            yield file.relative_to(REPOSITORY)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tools.mutants", description=__doc__)
    parser.add_argument(
        "paths", nargs="*", default=ROOMS, help=f"files or folders (default: {' '.join(ROOMS)})"
    )
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="how many at a time")
    parser.add_argument("--every", type=int, default=1, help="only each so many-th mutant")
    asked = parser.parse_args()
    jobs = max(1, asked.jobs)
    found = (one for path in files(asked.paths) for one in find(path, (REPOSITORY / path).read_text("utf-8")))
    chosen = list(islice(found, 0, None, asked.every))
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder, ThreadPoolExecutor(jobs) as pool:
        trees: Queue[Tree] = Queue()
        for n in range(jobs):
            trees.put(Tree(Path(folder) / str(n)))
        rooms = dict.fromkeys(mutant.path.parts[1] for mutant in chosen)
        tests = {room: tests_of(room, trees.queue[0]) for room in rooms}
        times = ", ".join(f"{room}: {seconds:.0f} s" for room, (_, seconds) in tests.items())
        print(f"{len(chosen)} mutants; all tests of {times}", flush=True)

        def survives(mutant: Mutant) -> bool:
            names, seconds = tests[mutant.path.parts[1]]
            tree = trees.get()
            try:
                return tree.survives(mutant, names, _LEAST_LIMIT_S + _LONGER * seconds)
            finally:
                trees.put(tree)

        left = Counter[Path]()
        for mutant, is_left in zip(chosen, pool.map(survives, chosen), strict=True):
            if is_left:
                left[mutant.path] += 1
                print(mutant, flush=True)
    for path, count in Counter(mutant.path for mutant in chosen).items():
        print(f"{path}: {left[path]} of {count} were not noticed")
    print(
        f"{left.total()} of {len(chosen)} were not noticed: {100 * left.total() / max(1, len(chosen)):.1f} %"
    )


if __name__ == "__main__":
    main()
