"""Output for a terminal: text without foreign control characters, and the progress of a long task."""

from __future__ import annotations

import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager

Show = Callable[[int, int | None, str], None]
"""Called with how much is done, of how much (None: not known), and the same in words."""


def printable(text: str) -> str:
    """``text`` with everything escaped that a terminal would obey instead of showing: names and strings
    come from devices and from other people's files."""
    if text.isprintable():
        return text
    return "".join(one if one.isprintable() else _escaped(one) for one in text)


def _escaped(character: str) -> str:
    return character.encode("unicode_escape").decode("ascii")


def printable_lines(text: str) -> str:
    """Text as ``printable`` makes it, but our own line breaks stay."""
    return "\n".join(map(printable, text.split("\n")))


@contextmanager
def progress(text: str) -> Generator[Show]:
    """Shows on standard error what is being done, for how long, and how far it is, where that is a
    terminal."""
    if not sys.stderr.isatty():
        yield lambda done, total, words: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}", markup=False),
        BarColumn(bar_width=24),
        TextColumn("{task.fields[words]}", markup=False),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(printable(text), total=None, words="")

        def show(done: int, total: int | None, words: str) -> None:
            bar.update(task, completed=done, total=total, words=printable(words))

        yield show
