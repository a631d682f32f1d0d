"""``drivebridge``: arguments in, service out."""

from __future__ import annotations

from bridge.cli.app import run_app


def main() -> None:
    run_app()


if __name__ == "__main__":
    main()
