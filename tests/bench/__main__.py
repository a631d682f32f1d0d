"""All benchmarks as one report: ``make bench``.

    python -m tests.bench [--rates 250,1000] [--changed 10,100] [--rounds 3] [--seconds 6] [--writes 300]
                          [--no-lab] [--only-single] [--told FILE] --json FILE --plots FOLDER PAGE

PAGE gets it between its marks. What end to end means: tests/bench/reference/README.md.
"""

from __future__ import annotations

import argparse
import ast
import dataclasses
import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from tests.bench import end_to_end, end_to_end_report, write_to_rpdo
from tests.bench.end_to_end_report import table
from tests.bench.end_to_end_runs import BRIDGES, Cell, machine
from tests.bench.figures import TOLD
from tests.bench.targets import Found, rows

HERE: Final = Path(__file__).resolve().parent
REPOSITORY: Final = HERE.parents[1]
LAB_S: Final = 900
TOLD_FILE: Final = "told.jsonl"
"""Beside the JSON: what single benchmarks have told."""
BEGIN: Final = "<!-- What follows is made by `make bench`. -->"
END: Final = "<!-- end of what `make bench` makes -->"


def singles(*, lab: bool, build: Path) -> list[tuple[str, str, str, float | None]]:
    """What the ``bench_*.py`` tell. Raises CalledProcessError where one of them fails."""
    told = build / TOLD_FILE
    told.unlink(missing_ok=True)
    pytest = [sys.executable, "-m", "pytest", "-s", "-q", "-p", "no:cacheprovider"]
    pytest += ["-o", "python_files=bench_*.py"]
    environment = {**os.environ, TOLD: str(told)}
    commands = [[*pytest, f"--ignore={HERE / 'lab'}", str(HERE)]]
    if lab:
        vcan = [str(REPOSITORY / "tests/lab/vcan-run"), "-n", "2", "-t", str(LAB_S), "--"]
        commands.append([*vcan, *pytest, str(HERE / "lab")])
    for command in commands:
        subprocess.run(command, env=environment, cwd=REPOSITORY, check=True)
    return read(told)


def read(told: Path) -> list[tuple[str, str, str, float | None]]:
    return [tuple(json.loads(line)) for line in told.read_text(encoding="utf-8").splitlines()]


def title(file: str) -> str:
    """What a benchmark says of itself in its first sentence."""
    doc = ast.get_docstring(ast.parse((REPOSITORY / file).read_text(encoding="utf-8"))) or file
    first = doc.split("\n\n")[0].replace("\n", " ")
    return first.partition(". ")[0].rstrip(".")


def page(found: Found, told: Sequence[tuple[str, str, str, float | None]], where: dict[str, object]) -> str:
    libraries = where["libraries"]
    assert isinstance(libraries, dict)
    versions = ", ".join(f"{name} {version}" for name, version in libraries.items())
    parts = [
        f"Measured in one run on {where['cores']} cores of {where['cpu']}, Linux {where['kernel']}, "
        f"Python {where['python']}; {versions}.\n",
        "## Targets\n",
        table(("what", "target", "found", ""), list(rows(found))),
    ]
    if found.runs:
        parts += [
            "## End to end\n",
            "![CPU of all processes against PDOs a second](../images/end-to-end-cpu.svg)\n",
            "![Delay from the PDO to the Modbus register](../images/end-to-end-modbus.svg)\n",
            end_to_end_report.markdown(found.runs).replace("\n## ", "\n### "),
        ]
    if found.writes:
        parts += ["## From a write to the RPDO\n", write_to_rpdo.table(found.writes)]
    for file in dict.fromkeys(file for file, _, figure, _ in told if figure):
        lines = [[what, figure] for name, what, figure, _ in told if name == file and figure]
        parts += [f"## {title(file)}\n", table(("", ""), lines)]
    return "\n".join(parts)


def put(path: Path, text: str) -> None:
    """Between the marks of the page. Raises ValueError where it has none."""
    before, begin, rest = path.read_text(encoding="utf-8").partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise ValueError(f"{path} has no marks for what make bench makes")
    path.write_text(f"{before}{begin}\n\n{text}\n{end}{after}", encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    numbers = end_to_end.numbers
    parser.add_argument("--rates", type=numbers, default=list(end_to_end.RATES))
    parser.add_argument("--changed", type=numbers, default=list(end_to_end.CHANGED))
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=6.0)
    parser.add_argument("--writes", type=int, default=300)
    parser.add_argument("--no-lab", action="store_true", help="without SocketCAN")
    parser.add_argument("--only-single", action="store_true", help="without the bridges end to end")
    parser.add_argument("--told", type=Path, help=f"not measured again: a {TOLD_FILE}")
    parser.add_argument("--json", type=Path, required=True)
    parser.add_argument("--plots", type=Path, required=True)
    parser.add_argument("page", type=Path)
    given = parser.parse_args()
    build = given.json.resolve().parent
    build.mkdir(parents=True, exist_ok=True)
    where = machine()
    # First: where one of them fails, half an hour is not lost.
    told = read(given.told) if given.told else singles(lab=not given.no_lab, build=build)
    found = Found(numbers={what: number for _, what, _, number in told if number is not None})
    if not given.only_single:
        cells = [Cell(rate, changed) for changed in given.changed for rate in given.rates]
        found.runs = end_to_end.measure_all(cells, BRIDGES, given.rounds, given.seconds)
        loads = list(write_to_rpdo.PDOS_PER_S)
        found.writes = write_to_rpdo.measure_all(loads, BRIDGES, given.rounds, given.writes)
        for name, plot in end_to_end_report.plots(found.runs).items():
            (given.plots / name).write_text(plot, encoding="utf-8")
    put(given.page, page(found, told, where))
    everything = {
        "machine": where,
        "end_to_end": [dataclasses.asdict(run) for run in found.runs],
        "write_to_rpdo": [dataclasses.asdict(run) for run in found.writes],
        "told": told,
    }
    given.json.write_text(json.dumps(everything, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
