"""The fuzzers: ``python -m tests.fuzz --help``, or ``make fuzz``."""

from __future__ import annotations

import argparse
import secrets
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from tests.fuzz.case import Case, read_cases, write_cases
from tests.fuzz.reduce import reduced
from tests.fuzz.rig import running_rig
from tests.fuzz.run import Report, fuzz
from tests.fuzz.targets import PROTOCOLS


def main() -> int:
    parser = argparse.ArgumentParser(prog="tests.fuzz", description="Throw changed messages at the bridge.")
    parser.add_argument("protocols", nargs="*", metavar="PROTOCOL", help=", ".join(PROTOCOLS))
    parser.add_argument("--seconds", type=float, default=600.0, help="for each protocol (default: 600)")
    parser.add_argument("--seed", type=int, help="of an earlier run, to throw the same again")
    parser.add_argument("--replay", type=Path, help="a file of build/fuzz: throw what it has, once")
    parser.add_argument("--reduce", action="store_true", help="of --replay: find the few cases that do it")
    parser.add_argument("--known", default="", help="a regular expression: faults to let pass")
    given = parser.parse_args()
    unknown = set(given.protocols) - set(PROTOCOLS)
    if unknown:
        parser.error(f"there is no protocol {', '.join(sorted(unknown))}; there are {', '.join(PROTOCOLS)}")
    protocols = given.protocols or PROTOCOLS
    if given.replay and len(protocols) != 1:
        parser.error("--replay needs the one protocol that the file is of")
    if given.reduce and not given.replay:
        parser.error("--reduce needs --replay")
    if given.reduce:
        return _reduce(protocols[0], given.replay, given.known)
    replay = read_cases(given.replay) if given.replay else None
    seed = secrets.randbelow(2**32) if given.seed is None else given.seed
    failed: list[str] = []
    for protocol in protocols:
        print(f"== {protocol}: {given.seconds:g} s, seed {seed}", flush=True)
        report = _run(protocol, given.seconds, seed, replay, given.known)
        print(report.told(), flush=True)
        if report.faults:
            failed.append(protocol)
    if failed:
        print(f"== not borne: {', '.join(failed)}")
    return 1 if failed else 0


def _run(
    protocol: str, seconds: float, seed: int, replay: Sequence[Case] | None = None, known: str = ""
) -> Report:
    """On a bridge of its own."""
    with tempfile.TemporaryDirectory(prefix="drivebridge-fuzz-") as folder, running_rig(Path(folder)) as rig:
        return fuzz(rig, [protocol], seconds, seed, replay, known)


def _reduce(protocol: str, path: Path, known: str) -> int:
    """Each try takes a new bridge: some minutes for a file of hundreds."""

    def fails(cases: Sequence[Case]) -> bool:
        report = _run(protocol, 600.0, 0, cases, known)
        print(f"{len(cases)} cases: {report.faults[0] if report.faults else 'borne'}", flush=True)
        return bool(report.faults)

    cases = read_cases(path)
    if not fails(cases):
        print("== these cases alone do nothing")
        return 1
    few = reduced(cases, fails)
    shown = path.with_suffix(".reduced.jsonl")
    write_cases(shown, few)
    print(f"== {shown}:")
    for case in few:
        print(case.as_line())
    return 0


if __name__ == "__main__":
    sys.exit(main())
