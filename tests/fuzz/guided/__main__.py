"""Fuzz every codec and parser, guided by coverage.

    python -m tests.fuzz.guided [NAME ...] [--seconds N] [--jobs N] [--keep]

Each of the parsers (of all, unless some are named) gets ``--seconds``, ``--jobs`` at a time. What was found
is in ``build/fuzz``, with the command that plays it again; ends with 1 then. ``--keep`` takes what covers
something new into the corpus.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Final

from tests.fuzz.guided import corpus
from tests.fuzz.guided.parsers import PARSERS

_FOUND: Final = Path("build/fuzz")
_LIMITS: Final = ("-rss_limit_mb=1500", "-timeout=20", "-max_len=8192")
_TOLD: Final = 40


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(PARSERS))
    parser.add_argument("--seconds", type=int, default=20)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--keep", action="store_true")
    asked = parser.parse_args()
    names = asked.names or list(PARSERS)
    if unknown := set(names) - set(PARSERS):
        parser.error(f"no parser {', '.join(sorted(unknown))}: {', '.join(PARSERS)}")
    _FOUND.mkdir(parents=True, exist_ok=True)
    with ThreadPoolExecutor(asked.jobs) as pool:
        results = list(pool.map(lambda name: _fuzz(name, asked.seconds, keeps=asked.keep), names))
    return int(not all(results))


def _fuzz(name: str, seconds: int, *, keeps: bool) -> bool:
    """Whether nothing was found."""
    with tempfile.TemporaryDirectory() as folder:
        known, fresh = Path(folder) / "known", Path(folder) / "fresh"
        fresh.mkdir()
        corpus.unpack([*corpus.kept(name), *PARSERS[name].seeds()], known)
        before = set(_FOUND.glob(f"{name}-*"))
        done = _run(name, f"-artifact_prefix={_FOUND / name}-", f"-max_total_time={seconds}", fresh, known)
        figures = [line for line in done.stderr.splitlines() if re.match(r"#\d", line)]
        print(f"{name}: {' '.join(figures[-1].split()) if figures else 'did not begin'}", flush=True)
        if done.returncode or not figures:
            print("\n".join(done.stderr.splitlines()[-_TOLD:]))
            for found in sorted(set(_FOUND.glob(f"{name}-*")) - before):
                print(f"again: {sys.executable} -m tests.fuzz.guided.one {name} {found}", flush=True)
            return False
        if keeps:
            count = corpus.keep(name, [*corpus.kept(name), *(one.read_bytes() for one in fresh.iterdir())])
            print(f"{name}: {count} inputs are kept")
        return True


def _run(name: str, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "tests.fuzz.guided.one", name, *_LIMITS, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, errors="replace", check=False)


if __name__ == "__main__":
    sys.exit(main())
