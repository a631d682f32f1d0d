"""A process that is stopped knows it before it does anything else."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

from tests.support.process import until

# Each turn ends with a system call, at whose end the process is stopped.
SCRIPT = """
import os, signal, sys, time
from bridge.master.standstill import SignalAlarm, StoodStill

alarm = SignalAlarm()
for turn in range(20):
    alarm.set(0.05)
    time.monotonic()
    assert not alarm.rang
    print("stopping", flush=True)
    os.kill(os.getpid(), signal.SIGSTOP)
    known = alarm.rang
    print(known, flush=True)
    alarm.set(0.05)
    try:
        alarm.breaks_in = True
        print("stopping", flush=True)
        os.kill(os.getpid(), signal.SIGSTOP)
        print("goes on", flush=True)
    except StoodStill:
        print(alarm.breaks_in, flush=True)
alarm.set(0.02)
alarm.set(0.0)
time.sleep(0.05)
print(alarm.rang, flush=True)
"""


def is_stopped(pid: int) -> bool:
    status = Path(f"/proc/{pid}/stat").read_text(encoding="ascii", errors="replace")
    return status.rpartition(")")[2].split()[0] == "T"


def test_an_alarm_rings_before_a_stopped_process_goes_on() -> None:
    with subprocess.Popen([sys.executable, "-c", SCRIPT], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout
        for answer in ["True\n", "False\n"] * 20:
            assert process.stdout.readline() == "stopping\n"
            until(lambda: is_stopped(process.pid), 10.0, "it is stopped")
            time.sleep(0.1)
            process.send_signal(signal.SIGCONT)
            assert process.stdout.readline() == answer
        assert process.stdout.readline() == "False\n"
    assert process.returncode == 0
