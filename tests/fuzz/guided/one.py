"""One parser under libFuzzer: ``python -m tests.fuzz.guided.one NAME [libFuzzer's arguments]``.

Ends with libFuzzer's exit code, which is not 0 where something was found.
"""

from __future__ import annotations

import logging
import sys

import atheris

with atheris.instrument_imports(include=["bridge", "asyncua.ua", "can.io"]):
    from tests.fuzz.guided.parsers import PARSERS


def main() -> None:
    name, *arguments = sys.argv[1:]
    logging.disable(logging.CRITICAL)
    atheris.Setup([sys.argv[0], *arguments], PARSERS[name].feed)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
