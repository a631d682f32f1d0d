"""Records the corpus anew: ``python -m tests.fuzz.recorder [PROTOCOL ...]``.

Real clients speak to the real bridge through a proxy; what they said is written to ``tests/fuzz/corpus``.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Final

from tests.fuzz.recorder import can, modbus, opcua, zenoh_clients
from tests.fuzz.rig import Rig, running_rig

RECORDERS: Final[dict[str, Callable[[Rig], list[Path]]]] = {
    "modbus": modbus.record,
    "opcua": opcua.record,
    "zenoh": zenoh_clients.record,
    "can": can.record,
}


def main(protocols: list[str]) -> None:
    with tempfile.TemporaryDirectory(prefix="drivebridge-fuzz-") as name:
        folder = Path(name)
        (folder / "frames").touch()
        with running_rig(folder) as rig:
            for protocol in protocols or RECORDERS:
                for path in RECORDERS[protocol](rig):
                    print(f"{path}: {path.stat().st_size} bytes")


if __name__ == "__main__":
    main(sys.argv[1:])
