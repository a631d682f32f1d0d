"""``drivebridge``: arguments in, service out."""

from __future__ import annotations

import signal

# First of all: the imports take a second, and whoever ends us meanwhile wants no traceback.
signal.signal(signal.SIGINT, signal.SIG_DFL)

import sys  # noqa: E402

from bridge.cli.ending_signals import ending_signals  # noqa: E402
from bridge.cli.process_exit import leave_after  # noqa: E402

_STAY_UP = ("run", "demo", "simulate")


def main() -> None:
    if sys.argv[1:2] and sys.argv[1] in _STAY_UP:
        ending_signals.hold()
    leave_after(_run)


def _run() -> None:
    from bridge.cli.app import run_app

    run_app(_take_interrupts)


def _take_interrupts() -> None:
    """Not before: an exception in the midst of an import may come out as another one."""
    if not ending_signals.is_held:
        signal.signal(signal.SIGINT, signal.default_int_handler)


if __name__ == "__main__":
    main()
