"""A device description all the way: read, made into a mapping, simulated, booted, served."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from bridge.eds import read_device
from bridge.errors import BridgeError
from bridge.image import Quality
from bridge.sim.nmt_slave import NmtState
from tests.support.invented_eds import DerivedBench


@dataclass(frozen=True, slots=True)
class Result:
    """How far a file came; ``problem`` is empty where it came all the way."""

    name: str
    step: str
    problem: str = ""


def served(folder: Path, name: str, content: bytes) -> Result:
    """What becomes of a file. What is no drive with CiA 402 ends with the step ``mapping``."""
    folder.mkdir(parents=True)
    try:
        description = read_device(content, name)
    except BridgeError as error:
        return Result(name, "read", str(error))
    try:
        bench = DerivedBench(folder, description)
    except BridgeError as error:
        return Result(name, "mapping", str(error))
    status = str(bench.value("conveyor/node/boot_status"))
    if bench.generic.slave.state is not NmtState.OPERATIONAL:
        return Result(name, "boot", status)
    point = bench.plant.image.read("conveyor/drive/status/status_word")
    if point.quality is not Quality.GOOD:
        return Result(name, "serve", f"the status word is {point.quality.label}: {status}")
    return Result(name, "served")


def table(results: Sequence[Result]) -> str:
    """Those that did not come all the way, with the reason, and how many did."""
    lines = [f"{one.name}: {one.step}: {one.problem}" for one in results if one.problem]
    good = sum(not one.problem for one in results)
    return "\n".join([*lines, f"{good} of {len(results)} are booted and served"])
