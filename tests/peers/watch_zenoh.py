"""Subscribes to everything of the site "bench", until SIGTERM: watch_zenoh.py PORT NODES REPORT

REPORT becomes a JSON file: for each node, when value 1 was seen to be what, as [monotonic s, value].
"""

import json
import sys
import time
from pathlib import Path

import zenoh

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.peers.last_words import report_on_sigterm

TOP = "drives/bench"
WATCHED = "/actual/value_1"


def connected(port: int) -> zenoh.Session:
    """The bridge may still be starting."""
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([f"tcp/127.0.0.1:{port}"]))
    config.insert_json5("scouting/multicast/enabled", "false")
    # The front that serves zenoh may still be starting.
    config.insert_json5("connect/timeout_ms", "30000")
    while True:
        try:
            return zenoh.open(config)
        except zenoh.ZError:
            time.sleep(0.1)


def main(port: int, nodes: int, report: Path) -> None:
    seen: dict[int, list[tuple[float, int]]] = {number: [] for number in range(1, nodes + 1)}

    report_on_sigterm(report, lambda: seen)

    def on_sample(sample: zenoh.Sample) -> None:
        key = str(sample.key_expr)
        if not key.endswith(WATCHED):
            return
        value = json.loads(sample.payload.to_string())["v"]
        if value is not None:
            number = key.removeprefix(f"{TOP}/n").partition("/")[0]
            seen[int(number)].append((time.monotonic(), value))

    with connected(port) as session:
        session.declare_subscriber(f"{TOP}/**", on_sample)
        print("watching", flush=True)
        while True:
            time.sleep(1)


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3]))
