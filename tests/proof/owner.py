"""The controller of all drives of one protocol, as a process that can be stopped and killed.

``python -m tests.proof.owner PROTOCOL BOARD``: this process only loads what a client needs. For each line
on its standard input it forks an owner and prints its process id: a killed one is replaced at once.
"""

from __future__ import annotations

import asyncio
import gc
import importlib
import os
import signal
import sys
import time
from pathlib import Path

from tests.proof.board import NUMBERS, Board
from tests.proof.clients import CLIENTS, Client, ClientFault
from tests.proof.drives import DRIVES, Drive, drives_of
from tests.proof.settings import PLANT

_LOOK_S = 0.05
_AGAIN_S = 0.1
_NICE = 5
"""As the OPC UA front, which would not come to answer otherwise."""


async def own(protocol: str, board: Board) -> None:
    """Write the telegrams that the board asks for, for ever: in a period, and at once where they change."""
    while True:
        client = CLIENTS[protocol]()
        try:
            await client.connect()
            await _write(client, protocol, board)
        except ClientFault:
            await client.close()
            await asyncio.sleep(_AGAIN_S)


async def _write(client: Client, protocol: str, board: Board) -> None:
    drives = drives_of(protocol)
    number = 0
    while True:
        began = time.monotonic()
        number = (number + 1) % NUMBERS
        words = _words(board, drives)
        telegrams = [
            (drive, word, drive.family.setpoint + number) for drive, word in zip(drives, words, strict=True)
        ]
        for drive in drives:
            board.stamp(drive.place, number, time.monotonic())
        for (drive, word, _), accepted in zip(telegrams, await client.write(telegrams), strict=True):
            if accepted:
                board.accept(drive.place, word)
        due = began + PLANT.owner_period_s
        # Another process changes the words: there is nothing to wait for.
        while time.monotonic() < due and words == _words(board, drives):  # noqa: ASYNC110
            await asyncio.sleep(max(0.0, min(_LOOK_S, due - time.monotonic())))


def _words(board: Board, drives: list[Drive]) -> list[int]:
    return [board.control_word(drive.place) for drive in drives]


def main() -> None:
    protocol, path = sys.argv[1:]
    board = Board(Path(path), len(DRIVES))
    os.nice(_NICE)
    importlib.import_module({"modbus": "pymodbus.client", "opcua": "asyncua", "zenoh": "zenoh"}[protocol])
    # A look at all that these load takes longer here than an owner may be silent.
    gc.collect()
    gc.freeze()
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    print("loaded", flush=True)
    for _ in sys.stdin:
        pid = os.fork()
        if not pid:
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            asyncio.run(own(protocol, board))
            return
        print(pid, flush=True)


main()
