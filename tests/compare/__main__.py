"""The comparison with other people's servers: ``python -m tests.compare --help``, or ``make compare``."""

from __future__ import annotations

import argparse
import secrets
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor

from tests.compare.cases import SETS
from tests.compare.differences import DIFFERENCES
from tests.compare.run import Report, compare
from tests.compare.servers import Servers, missing


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="tests.compare", description="Send the same requests to our server, open62541 and node-opcua."
    )
    parser.add_argument("sets", nargs="*", metavar="SET", help=", ".join(SETS))
    parser.add_argument("--cases", type=int, default=2000, help="for each service set (default: 2000)")
    parser.add_argument("--seed", type=int, help="of an earlier run, to ask the same again")
    parser.add_argument(
        "--jobs", type=int, default=4, help="how many at a time, each with servers of its own"
    )
    given = parser.parse_args()
    unknown = set(given.sets) - set(SETS)
    if unknown:
        parser.error(f"there is no service set {', '.join(sorted(unknown))}; there are {', '.join(SETS)}")
    if absent := missing():
        parser.error(absent)
    seed = secrets.randbelow(2**32) if given.seed is None else given.seed
    print(f"== seed {seed}", flush=True)
    rows, failed = Counter[int](), False
    for name in given.sets or SETS:
        began = time.monotonic()
        report = _run(name, given.cases, seed, given.jobs)
        rows += report.rows
        failed |= bool(report.fault)
        print(f"== {_line(report)}, {time.monotonic() - began:.0f} s", flush=True)
        if report.fault:
            print(report.fault)
    if not given.sets:
        for place, row in enumerate(DIFFERENCES):
            if not rows[place]:
                print(f"== never seen: {row.service}: {row.asked}")
    return failed


def _run(name: str, cases: int, seed: int, jobs: int) -> Report:
    whole = Report(name)
    with ProcessPoolExecutor(jobs) as pool:
        share = -(-cases // jobs)
        parts = [pool.submit(_part, name, share, seed + place) for place in range(jobs)]
        for part in parts:
            whole.add(part.result())
    return whole


def _part(name: str, cases: int, seed: int) -> Report:
    servers = Servers()
    try:
        return compare(servers, name, cases, seed)
    finally:
        servers.close()


def _line(report: Report) -> str:
    known = f"{report.rows.total()} known differences by {len(report.rows)} rows"
    told = f", {report.told} notifications" if report.told else ""
    once = f", {report.once} that were there only once" if report.once else ""
    counts = f"{report.cases} cases, {report.requests} requests{told}, {known}{once}"
    return f"{report.service_set}: {counts}, {'one that is not known' if report.fault else 'none unknown'}"


if __name__ == "__main__":
    sys.exit(main())
