"""A simulated CiA 402 drive on SocketCAN. SIGUSR1 makes its motor too warm (4310h).

cia402_slave.py CHANNEL NODE_ID BITRATE
"""

from __future__ import annotations

import asyncio
import signal
import sys

from bridge.can import open_bus
from bridge.sim.cia402.cia402_drive import Cia402Drive
from bridge.sim.runner import Simulation


async def main(channel: str, node_id: int, bitrate: int) -> None:
    node = Cia402Drive(node_id)
    simulation = Simulation(open_bus("can0", "socketcan", channel, bitrate), [node])

    def fail() -> None:
        node.fail(0x4310)
        simulation.poke()

    asyncio.get_running_loop().add_signal_handler(signal.SIGUSR1, fail)
    print("the drive is there", flush=True)
    try:
        await simulation.run()
    finally:
        simulation.close()


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3])))
