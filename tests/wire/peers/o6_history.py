"""Reads history with open62541: o6_history.py URL NAME, the name of a point. Prints one line of JSON."""

from __future__ import annotations

import json
import sys
from datetime import UTC, datetime, timedelta

import o6


def main(url: str, name: str) -> None:
    client = o6.Client(url)
    client.connect(createDefaultSubscription=False)
    uris = client.read("i=2255")
    where = f"ns={list(uris).index('urn:drivebridge:points')};s={name}"
    end = datetime.now(UTC) + timedelta(minutes=1)
    start = end - timedelta(hours=1)

    def read(*times: datetime, most: int = 0) -> list[float]:
        found = client.historyRead(where, *times, numValuesPerNode=most)
        return [float(one.value) for one in found.dataValues]

    seen = {"forwards": read(start, end), "backwards": read(end, start), "first": read(start, end, most=2)}
    client.disconnect()
    print(json.dumps(seen))


if __name__ == "__main__":
    main(*sys.argv[1:])
