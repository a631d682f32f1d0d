"""Whether the unit tests notice small faults in the code: ``make mutants``.

    python -m tools.mutants [--jobs N] [--every N] [--seconds S] [--tests FOLDER] [FILE_OR_FOLDER ...]

Each mutant is the program with one small change: a comparison, an operator, a constant, a call left out. The
unit tests that run the changed line run on it, until one fails; first the quick ones that run little beside
its file. Mutants that no test notices are printed: either a test is missing, or the change makes no
difference that anybody could see.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Final

from tools.mutants.find import Mutant, find
from tools.mutants.run import REPOSITORY, Recorded, has_survived, record

ROOMS: Final = ("bridge/command", "bridge/canopen")
_PARTS: Final = 4
"""Of the tests, for each job: some are done sooner than others."""
_SUITE = Recorded()
"""Set before the processes are forked that use it."""


def files(asked: list[str], pattern: str = "*.py") -> Iterator[Path]:
    for name in asked:
        path = (REPOSITORY / name).resolve()
        for file in sorted(path.rglob(pattern)) if path.is_dir() else [path]:
            yield file.relative_to(REPOSITORY)


def _is_left(most_s: float, mutant: Mutant) -> bool:
    return has_survived(mutant, _SUITE, most_s)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tools.mutants", description=__doc__)
    parser.add_argument(
        "paths", nargs="*", default=ROOMS, help=f"files or folders (default: {' '.join(ROOMS)})"
    )
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="how many at a time")
    parser.add_argument("--every", type=int, default=1, help="only each so many-th mutant")
    parser.add_argument("--seconds", type=float, default=20.0, help="tests of this long at most for each")
    parser.add_argument("--tests", default="tests/unit", help="where they are (default: tests/unit)")
    asked = parser.parse_args()
    found = (one for path in files(asked.paths) for one in find(path, (REPOSITORY / path).read_text("utf-8")))
    chosen = list(islice(found, 0, None, asked.every))
    # Examples that are found are of the mutants: they say nothing about the program.
    with tempfile.TemporaryDirectory(prefix="mutants-") as examples:
        os.environ["HYPOTHESIS_STORAGE_DIRECTORY"] = examples
        os.environ["LANDING"] = "1"  # also what runs only before a change lands
        left = _try(chosen, list(map(str, files([asked.tests], "test_*.py"))), asked.jobs, asked.seconds)
    for path, count in Counter(mutant.path for mutant in chosen).items():
        print(f"{path}: {left[path]} of {count} were not noticed")
    share = 100 * left.total() / max(1, len(chosen))
    print(f"{left.total()} of {len(chosen)} were not noticed: {share:.1f} %")


def _try(chosen: list[Mutant], tests: list[str], jobs: int, most_s: float) -> Counter[Path]:
    """How many of each file are left."""
    parts = [part for n in range(_PARTS * jobs) if (part := tests[n :: _PARTS * jobs])]
    sources = tuple({str(REPOSITORY / mutant.path.parent) for mutant in chosen})
    fork = multiprocessing.get_context("fork")
    with fork.Pool(jobs) as pool:
        for part in pool.imap_unordered(partial(record, sources), parts, chunksize=1):
            _SUITE.add(part)
    if _SUITE.failed:
        sys.exit(f"these fail on the program as it is: {' '.join(_SUITE.failed)}")
    seconds = sum(_SUITE.took_s.values())
    print(f"{len(chosen)} mutants, {len(_SUITE.took_s)} tests of {seconds:.0f} s", flush=True)
    left = Counter[Path]()
    with fork.Pool(jobs) as pool:
        for mutant, is_one in zip(chosen, pool.imap(partial(_is_left, most_s), chosen), strict=True):
            if is_one:
                left[mutant.path] += 1
                print(mutant, flush=True)
    return left


if __name__ == "__main__":
    main()
