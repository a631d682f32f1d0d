"""Figures of the dead-man chain on real SocketCAN, by kernel time stamps."""

from __future__ import annotations

import signal
import time
from contextlib import ExitStack
from itertools import pairwise
from pathlib import Path

from tests.bench.figures import milliseconds, show
from tests.lab.sites import lab_site
from tests.lab.test_dead_man import RPDO1, SYNC, TIMEOUT_S, Lab
from tests.support.process import until

ROUNDS = 5


def test_from_the_last_telegram_to_the_reaction(tmp_path: Path) -> None:
    late: list[float] = []
    for number in range(ROUNDS):
        folder = tmp_path / str(number)
        folder.mkdir()
        with ExitStack() as stack:
            lab = Lab(folder, stack, lab_site(folder, timeout_ms=200))
            lab.run_drive().signal(signal.SIGSTOP)
            until(lambda lab=lab: lab.turns_at(0), 10.0, "the drive stands still")
            last = lab.last_telegram()
            reaction = next(frame for frame in lab.bus.of(RPDO1, last) if not frame.word & 0x0002)
            late.append(reaction.time - last - TIMEOUT_S)
    show("fieldbus_timeout_ms = 200: reaction on the bus later than that by", milliseconds(late))


def test_from_the_stop_of_the_bridge_to_silence(tmp_path: Path) -> None:
    silent: list[float] = []
    for number in range(ROUNDS):
        folder = tmp_path / str(number)
        folder.mkdir()
        with ExitStack() as stack:
            lab = Lab(folder, stack, lab_site(folder, timeout_ms=200))
            lab.bridge.signal(signal.SIGSTOP)
            hung = time.time()
            time.sleep(0.5)
            silent.append(max([0.0, *(frame.time - hung for frame in lab.bus.of(SYNC, hung))]))
    show("deadman_ms = 100: last SYNC after the bridge was stopped", milliseconds(silent))


def test_the_kernels_beat(tmp_path: Path) -> None:
    with ExitStack() as stack:
        lab = Lab(tmp_path, stack, lab_site(tmp_path, timeout_ms=200))
        time.sleep(3.0)
        times = [frame.time for frame in lab.bus.of(SYNC)][5:]
        errors = [abs(b - a - 0.010) for a, b in pairwise(times)]
        show("SYNC every 10 ms from the kernel: error of the period", milliseconds(errors))
