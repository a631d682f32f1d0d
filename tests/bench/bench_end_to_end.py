"""Three lines of the end-to-end figures; the whole table is ``end_to_end.py``'s."""

from __future__ import annotations

import pytest

from tests.bench import end_to_end, write_to_rpdo
from tests.bench.end_to_end_runs import BRIDGES, Cell

SECONDS = 3.0
WRITES = 100


@pytest.mark.timeout(300)
@pytest.mark.parametrize("rate", [1000, 8000])
def test_from_the_bus_to_the_clients(rate: int) -> None:
    for bridge in BRIDGES:
        run = end_to_end.measure(bridge, Cell(rate, 100), 0, SECONDS)
        print(f"  {run.line}", flush=True)
        seen = [one.seen for one in run.delays.values()]
        assert all(seen), "each bridge shows its clients something"
        assert bridge != "ours" or not run.lost


def test_from_a_write_to_the_rpdo() -> None:
    for bridge in BRIDGES:
        run = write_to_rpdo.measure(bridge, "idle", 0, WRITES)
        print(f"  {run.line}", flush=True)
        assert not any(run.unwritten.values())
        assert not any(one.unseen for one in run.delays.values())
