"""A simulated STÖBER 5000 on SocketCAN. SIGUSR1 makes its motor too warm (event 41, cause 2).

stoeber_slave.py CHANNEL NODE_ID BITRATE
"""

from __future__ import annotations

import asyncio
import signal
import sys

from bridge.can import open_bus
from bridge.sim.runner import Simulation
from bridge.sim.stoeber.stoeber_5000 import Stoeber5000


async def main(channel: str, node_id: int, bitrate: int) -> None:
    node = Stoeber5000(node_id)
    simulation = Simulation(open_bus("can0", "socketcan", channel, bitrate), [node])

    def fail() -> None:
        node.fail(41, 2)
        simulation.poke()

    asyncio.get_running_loop().add_signal_handler(signal.SIGUSR1, fail)
    print("the drive is there", flush=True)
    try:
        await simulation.run()
    finally:
        simulation.close()


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3])))
