"""The fuzzers: ``python -m tests.fuzz --help``, or ``make fuzz``."""

from __future__ import annotations

import argparse
import secrets
import sys
import tempfile
from pathlib import Path

from tests.fuzz.case import read_cases
from tests.fuzz.rig import running_rig
from tests.fuzz.run import fuzz
from tests.fuzz.targets import PROTOCOLS


def main() -> int:
    parser = argparse.ArgumentParser(prog="tests.fuzz", description="Throw changed messages at the bridge.")
    parser.add_argument("protocols", nargs="*", metavar="PROTOCOL", help=", ".join(PROTOCOLS))
    parser.add_argument("--seconds", type=float, default=600.0, help="for each protocol (default: 600)")
    parser.add_argument("--seed", type=int, help="of an earlier run, to throw the same again")
    parser.add_argument("--replay", type=Path, help="a file of build/fuzz: throw what it has, once")
    given = parser.parse_args()
    unknown = set(given.protocols) - set(PROTOCOLS)
    if unknown:
        parser.error(f"there is no protocol {', '.join(sorted(unknown))}; there are {', '.join(PROTOCOLS)}")
    protocols = given.protocols or PROTOCOLS
    if given.replay and len(protocols) != 1:
        parser.error("--replay needs the one protocol that the file is of")
    replay = read_cases(given.replay) if given.replay else None
    seed = secrets.randbelow(2**32) if given.seed is None else given.seed
    failed: list[str] = []
    for protocol in protocols:
        print(f"== {protocol}: {given.seconds:g} s, seed {seed}", flush=True)
        with (
            tempfile.TemporaryDirectory(prefix="drivebridge-fuzz-") as folder,
            running_rig(Path(folder)) as rig,
        ):
            report = fuzz(rig, [protocol], given.seconds, seed, replay)
        print(report.told(), flush=True)
        if report.faults:
            failed.append(protocol)
    if failed:
        print(f"== not borne: {', '.join(failed)}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
