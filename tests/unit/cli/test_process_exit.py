"""End of a process of ours, whatever its threads are doing."""

from __future__ import annotations

import subprocess
import sys

import pytest

HELD = "import threading; threading.Thread(target=threading.Event().wait, daemon=True).start()"
ENDS = {
    "pass": (0, ""),
    "raise SystemExit(3)": (3, ""),
    "raise SystemExit('a sentence')": (1, "a sentence\n"),
    "raise SystemExit": (0, ""),
    "raise KeyboardInterrupt": (130, ""),
    "raise RuntimeError('a fault')": (1, "RuntimeError: a fault\n"),
}


@pytest.mark.landing(12)
@pytest.mark.parametrize("thread", ["pass", HELD], ids=["alone", "with a thread left behind"])
@pytest.mark.parametrize("end", ENDS)
def test_a_process_ends_with_its_status_and_all_that_it_has_said(end: str, thread: str) -> None:
    lines = (
        "import atexit",
        "from bridge.cli.process_exit import leave_after",
        "atexit.register(print, 'the interpreter has ended')",
        "def work():",
        "    print('said', end='')",
        f"    {thread}",
        f"    {end}",
        "leave_after(work)",
    )
    done = subprocess.run(
        [sys.executable, "-c", "\n".join(lines)], capture_output=True, text=True, check=False
    )
    status, words = ENDS[end]
    assert done.returncode == status
    assert done.stderr.endswith(words)
    assert ("Traceback" in done.stderr) == ("RuntimeError" in end)
    # A thread that is left somewhere is not to see the interpreter end.
    assert done.stdout == "said" + ("" if thread is HELD else "the interpreter has ended\n")
