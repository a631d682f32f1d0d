"""The fault injection: ``make proof``.

    python -m tests.proof run --cycles N --out RESULT.json [--faults NAME,NAME]
    python -m tests.proof report --least N --page PAGE.md --figures FIGURES.md --out RESULT.json PART.json ...
    python -m tests.proof hunt --share FOLDER --out RESULT.json [--mutants NAME,NAME]
    python -m tests.proof survivors PART.json ...
    python -m tests.proof kills --page PAGE.md --figures FIGURES.md --out RESULT.json PART.json ...

``hunt``, ``survivors`` and ``kills`` are those of ``make proof-mutants``. ``run`` and ``hunt`` are for a
machine with vcan0, vcan1 and a mount namespace of its own (``tests/lab/vcan-run -n 2 -- unshare --mount
...``); the lab has short ones (``tests/lab/test_proof.py``). ``run`` and what makes the pages end with 1
where something has failed: a bound is exceeded by more than the machine was in the way. Where it is not more,
the measurement is void: it is shown, and its fault is injected once more.
"""

from __future__ import annotations

import argparse
import datetime
import json
import os
import platform
import sys
import tempfile
import time
from collections import Counter
from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path
from typing import Any

from tests.proof import hunt, mutants, report
from tests.proof import kills as kill_table
from tests.proof.fault import Fault
from tests.proof.faults import FAULTS, in_turn
from tests.proof.machine import is_user_mode
from tests.proof.measure import Sample
from tests.proof.rig import HOLD_S, Rig, Stuck
from tests.proof.rounds import run_round
from tests.proof.settings import IS_RECORDED, PLANT
from tests.support.process import REPOSITORY

_MOST_EXTRA_ROUNDS = 3
_LINES_SHOWN = 20
"""Of the bridge's log, where the plant was stuck."""


def say(text: str) -> None:
    print(f"{time.monotonic():8.1f}  {text}", flush=True)


def run(asked: argparse.Namespace) -> int:
    os.environ["PYTHONPATH"] = str(REPOSITORY)
    names, cycles, out = _names(asked.faults), asked.cycles, asked.out
    faults = [fault for fault in FAULTS if not names or fault.name in names]
    possible = in_turn([fault for fault in faults if fault.is_here])
    began = time.monotonic()
    samples: list[Sample] = []
    errors: list[str] = []
    rounds = Counter[str]()
    done = 0

    def collect() -> dict[str, Any]:
        return {
            "date": _today(),
            "machine": _machine(),
            "plant": PLANT.name,
            "faults": [fault.name for fault in FAULTS],
            "cells": sorted(
                {
                    (
                        fault.name,
                        subject.family_name + PLANT.label,
                        subject.protocol,
                        fault.per_round * PLANT.share,
                    )
                    for fault in possible
                    for subject in fault.subjects
                }
            ),
            "faults_missing": [fault.name for fault in faults if not fault.possible()],
            "cycles": done,
            "seconds": time.monotonic() - began,
            "by_themselves": rig.by_themselves,
            "stopped_in_vain": rig.stopped_in_vain,
            "errors": errors,
            "samples": [{**sample.record(), "over_ms": sample.over_ms} for sample in samples],
        }

    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="proof-")))
        rig = Rig(folder, stack)
        try:
            rig.noise_ms = asked.noise
            rig.hold_s = asked.hold
            rig.start()
            say("everything is there")
            rig.run_all()
            while done < cycles and time.monotonic() - began < asked.limit:
                # Staggered: nodes that were lost are asked again sooner where half a minute has passed since.
                due = [
                    fault for at, fault in enumerate(possible) if fault.is_due((done + at) % cycles, cycles)
                ]
                for fault in due:
                    samples += _round(rig, fault, errors)
                    rounds[fault.name] += 1
                done += 1
                say(f"cycle {done} of {cycles}")
            for _ in range(_MOST_EXTRA_ROUNDS):
                for fault in (fault for fault in possible if _lacks(samples, fault, rounds[fault.name])):
                    say(f"{fault.name}: once more, measurements of it are missing")
                    samples += _round(rig, fault, errors)
            if rig.frames_lost:
                errors.append(f"the witnesses have lost {rig.frames_lost} frames, and prove nothing")
            if IS_RECORDED:
                replays = rig.replayed()
                errors += replays.differences
                errors += [] if replays.outputs else ["the bridge was not recorded"]
                say(f"{replays.recordings} recordings replayed, {replays.outputs} outputs in all")
        except (Stuck, AssertionError) as error:
            errors.append(f"the plant is stuck: {error}")
        finally:
            _keep_logs(folder, out.parent / f"{out.stem}-logs")
            # At the end: it takes a second of the CPU, in which no owner gets it.
            result = collect()
            out.write_text(json.dumps(result, indent=1), encoding="utf-8")
    return _verdict(result, min(done, cycles))


def _lacks(samples: list[Sample], fault: Fault, least: int) -> bool:
    """A slow machine had stopped drives before the fault could, or made a measurement void."""
    counts = Counter(
        sample.drive for sample in samples if sample.fault == fault.name and sample.verdict != "void"
    )
    return any(counts[subject.path] < least for subject in fault.subjects)


def _round(rig: Rig, fault: Fault, errors: list[str]) -> list[Sample]:
    try:
        return run_round(rig, fault, say)
    except Stuck as error:
        errors.append(str(error))
        said = rig.bridge.output().splitlines()[-_LINES_SHOWN:] if rig.bridge else []
        say("\n  ".join([f"FAILED: {error}", *said]))
        rig.mend()
        return []


def _keep_logs(folder: Path, where: Path) -> None:
    where.mkdir(exist_ok=True)
    for log in [*folder.glob("*.log"), *folder.glob("disk/*.log"), *(folder / "watched").glob("*s")]:
        (where / log.name).write_bytes(log.read_bytes())


def _machine() -> str:
    cpu = "a CPU"
    for line in Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines():
        name, _, value = line.partition(":")
        if name.strip() in ("model name", "host"):
            cpu = value.strip()
    kernel = f"Linux {platform.release()}{' as a user-mode kernel on one CPU' if is_user_mode() else ''}"
    return f"{kernel}, {cpu}, Python {platform.python_version()}"


def _verdict(result: dict[str, Any], least: int) -> int:
    for cell in report.cells(result["samples"]):
        print("  ".join(cell.row()))
    return _tell(report.failures(result, least))


def _tell(failures: list[str]) -> int:
    for text in failures:
        print(f"FAILED: {text}")
    return 1 if failures else 0


def _names(text: str) -> list[str]:
    return [name for name in text.split(",") if name]


def hunt_mutants(asked: argparse.Namespace) -> int:
    os.environ["PYTHONPATH"] = str(REPOSITORY)
    names, out = _names(asked.mutants), asked.out
    chosen = [mutant for mutant in mutants.load() if not names or mutant.name in names]
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="mutants-")))
        tree = mutants.Tree(folder / "tree")
        began = time.monotonic()
        rig = Rig(folder, stack, tree.folder)
        rig.noise_ms = asked.noise
        share = hunt.Share(asked.share or folder / "share")
        try:
            rig.start()
            say("everything is there")
            rig.run_all()
            rig.patience_s = hunt.PATIENCE_S
            alarms = [] if asked.only else hunt.try_unchanged(rig, share, say)
            kills = [hunt.hunt(rig, tree, mutant, say) for mutant in chosen if share.take(mutant.name)]
        finally:
            _keep_logs(folder, out.parent / f"{out.stem}-logs")
    found = {
        "date": _today(),
        "machine": _machine(),
        "seconds": time.monotonic() - began,
        "mutants": [mutant.name for mutant in chosen],
        "false_alarms": alarms,
        "kills": [asdict(kill) for kill in kills],
    }
    out.write_text(json.dumps(found, indent=1), encoding="utf-8")
    return 0


def _today() -> str:
    return datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d")


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.proof", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("run")
    one.add_argument("--cycles", type=int, default=24)
    one.add_argument("--faults", default="")
    one.add_argument("--limit", type=float, default=2400.0, help="begin no cycle after so many seconds")
    one.add_argument("--noise", type=float, default=0.0, help="ms allowed on a machine that is busy")
    one.add_argument(
        "--hold", type=float, default=HOLD_S, help='s of "run" after each fault, which moves nothing'
    )
    other = commands.add_parser("report")
    other.add_argument("--least", type=int, default=24)
    third = commands.add_parser("hunt")
    third.add_argument("--share", type=Path, help="a folder that all machines have, which share the work")
    third.add_argument("--only", action="store_true", help="do not try the program as it is")
    third.add_argument("--mutants", default="", help="left out: all")
    third.add_argument("--noise", type=float, default=0.0, help="ms allowed on a machine that is busy")
    fourth = commands.add_parser("kills")
    fifth = commands.add_parser("survivors")
    for command in (other, fourth):
        command.add_argument("--page", type=Path, required=True, help="gets the summary between its marks")
        command.add_argument("--figures", type=Path, required=True, help="gets the tables between its marks")
    for command in (other, fourth, fifth):
        command.add_argument("parts", type=Path, nargs="+")
    for command in (one, other, third, fourth):
        command.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    if asked.command == "hunt":
        return hunt_mutants(asked)
    if asked.command == "survivors":
        print(",".join(kill_table.survivors(kill_table.merge([report.load(part) for part in asked.parts]))))
        return 0
    if asked.command == "kills":
        found = kill_table.merge([report.load(part) for part in asked.parts])
        asked.out.write_text(json.dumps(found, indent=1), encoding="utf-8")
        kill_table.put_into(asked.page, asked.figures, found)
        return _tell(kill_table.failures(found))
    if asked.command == "run":
        return run(asked)
    result = report.merge([report.load(part) for part in asked.parts])
    asked.out.write_text(json.dumps(result, indent=1), encoding="utf-8")
    report.put_into(asked.page, asked.figures, result)
    return _verdict(result, asked.least)


sys.exit(main())
