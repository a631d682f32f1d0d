"""What each connected client costs, by the number of them. What the clients do: tests/peers/clients.py."""

from __future__ import annotations

import signal
import time
from pathlib import Path

import pytest

from tests.bench.end_to_end_rig import NODES, Client, Traffic, rig
from tests.bench.figures import record, show
from tests.bench.processes import usage
from tests.bench.reference.command_line import Ports

COUNTS = (1, 10, 50)
TRAFFIC = Traffic(rate=500, changed=100, seconds=7.0)
REST_S = 1.5
"""Until all have what they asked for."""
MEASURED_S = 5.0


def measure(folder: Path, protocol: str, count: int) -> tuple[float, float]:
    """CPU of the bridge in % of a core, and its memory in MB."""

    def clients(at: Ports) -> dict[str, Client]:
        port = getattr(at, protocol)
        return {"clients": Client("clients", (protocol, port, count, at.nodes), f"{count} are there")}

    folder.mkdir()
    with rig("ours", TRAFFIC, folder, clients) as all_of_it:
        all_of_it.plant.signal(signal.SIGUSR1)
        time.sleep(REST_S)
        before, begin = usage(all_of_it.bridge.pid), time.monotonic()
        time.sleep(MEASURED_S)
        after, took_s = usage(all_of_it.bridge.pid), time.monotonic() - begin
    return 100 * (after.cpu_s - before.cpu_s) / took_s, after.memory_mb


@pytest.mark.timeout(300)
@pytest.mark.parametrize("protocol", ["modbus", "opcua", "zenoh"])
def test_what_a_client_costs(tmp_path: Path, protocol: str) -> None:
    assert COUNTS[1] <= NODES
    found = {count: measure(tmp_path / str(count), protocol, count) for count in COUNTS}
    few, many = found[COUNTS[0]], found[COUNTS[-1]]
    more = COUNTS[-1] - COUNTS[0]
    each_percent, each_mb = (many[0] - few[0]) / more, (many[1] - few[1]) / more
    record(f"{protocol}: each further client, % of a core", each_percent)
    record(f"{protocol}: each further client, MB", each_mb)
    shown = "   ".join(f"{count}: {cpu:.1f} %, {memory:.0f} MB" for count, (cpu, memory) in found.items())
    show(f"{protocol}, 500 PDO/s, so many clients", shown)
    show("  each further one", f"{each_percent:.2f} % of a core, {each_mb:.2f} MB")
