"""``drivebridge``: arguments in, service out."""

from __future__ import annotations

import sys

from bridge.cli.signals import ending_signals

_STAY_UP = ("run", "demo", "simulate")


def main() -> None:
    # First of all: the imports take a second, and whoever ends us meanwhile wants no traceback.
    if sys.argv[1:2] and sys.argv[1] in _STAY_UP:
        ending_signals.hold()
    from bridge.cli.app import run_app

    run_app()


if __name__ == "__main__":
    main()
