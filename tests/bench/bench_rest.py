"""What the demo takes while nobody uses it: four of its drives are moved by its own controller."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from tests.bench.figures import record, show
from tests.bench.processes import usage
from tests.support.process import drivebridge, only_demo

REST_S = 5.0
MEASURED_S = 20.0


@pytest.mark.timeout(120)
def test_the_demo_at_rest(tmp_path: Path) -> None:
    with only_demo(), drivebridge(tmp_path, "demo", "demo", notify=True) as process:
        process.wait_ready()
        process.wait_output("OPC UA on")
        time.sleep(REST_S)
        before, begin = usage(process.pid), time.monotonic()
        time.sleep(MEASURED_S)
        after, took_s = usage(process.pid), time.monotonic() - begin
    percent = 100 * (after.cpu_s - before.cpu_s) / took_s
    record("demo at rest, % of a core", percent)
    show(
        f"the demo at rest, {after.processes} processes",
        f"{percent:.1f} % of a core, {after.memory_mb:.0f} MB",
    )
