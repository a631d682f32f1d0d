"""Reader of a page of the documentation: runs its commands, saves its files, compares outputs."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.support.docs import (
    Block,
    Command,
    Page,
    commands,
    output_pattern,
    squeezed,
)
from tests.support.process import REPOSITORY, Process

DEMO_COMMANDS = ("make demo", "drivebridge demo")
COMMAND_LIMIT_S = 20.0


class Reader:
    """Reader who sits in the repository with .venv activated and does what a page says."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        for name in ("bridge", "deploy", "mappings", "tests"):
            (folder / name).symlink_to(REPOSITORY / name)
        (folder / ".venv").symlink_to(sys.prefix)
        self._environment = {
            **os.environ,
            "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}",
            "PYTHONUNBUFFERED": "1",
            "PYTHONWARNINGS": "ignore",
            "COLUMNS": "100",
        }
        self._up: list[subprocess.Popen[str]] = []
        self.skipped: list[str] = []

    def work_through(self, page: Page, demo: Process) -> None:
        for block in page.blocks:
            where = f"{page}:{block.line}"
            if block.file_name:
                (self.folder / block.file_name).write_text(block.text, encoding="utf-8")
            if block.note("Ctrl-C") is not None:
                self._end_last()
            if block.note("not run") is not None or (page.is_not_run and block.language == "console"):
                self._check_demo(block, demo)
            elif block.language == "python" and not block.file_name:
                self._run(Command(block.line, f"python - <<'END'\n{block.text}END", ""), where)
            elif block.language == "console":
                for command in commands(block):
                    self._do(command, f"{page}:{command.line}", stays_up=block.note("stays up") is not None)

    def _check_demo(self, block: Block, demo: Process) -> None:
        """`make demo` is not started a second time, but what it prints is compared."""
        if block.language == "console":
            for command in commands(block):
                if command.text in DEMO_COMMANDS:
                    compare(command, demo.output(), f"line {command.line}")

    def _do(self, command: Command, where: str, *, stays_up: bool) -> None:
        if "mbpoll" in command.text and not shutil.which("mbpoll"):
            self.skipped.append(where)
        elif stays_up:
            self._start(command, where)
        else:
            self._run(command, where)

    def _run(self, command: Command, where: str) -> None:
        done = subprocess.run(
            ["bash", "-c", command.text],
            cwd=self.folder,
            env=self._environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=COMMAND_LIMIT_S,
            check=False,
        )
        if done.returncode:
            pytest.fail(f"{where}: {command.text}\n{done.stdout}", pytrace=False)
        if command.expected:
            compare(command, done.stdout, where)

    def _start(self, command: Command, where: str) -> None:
        """A command that stays up: until it has said all that the page shows."""
        log = self.folder / f"{len(self._up)}.log"
        with log.open("w", encoding="utf-8") as output:
            process = subprocess.Popen(
                ["bash", "-c", command.text],
                cwd=self.folder,
                env=self._environment,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                text=True,
                start_new_session=True,  # so that Ctrl-C reaches what the shell has started
            )
        self._up.append(process)
        pattern = output_pattern(command.expected)
        end = time.monotonic() + COMMAND_LIMIT_S
        while not pattern.match(squeezed(log.read_text(encoding="utf-8"))):
            if time.monotonic() > end or process.poll() is not None:
                said = log.read_text(encoding="utf-8")
                pytest.fail(
                    f"{where}: {command.text}\nexpected:\n{command.expected}\nsaid:\n{said}", pytrace=False
                )
            time.sleep(0.05)

    def _end_last(self) -> None:
        if not self._up:  # it was skipped
            return
        process = self._up.pop()
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGINT)
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()

    def end(self) -> None:
        while self._up:
            self._end_last()


def compare(command: Command, output: str, where: str) -> None:
    expected, is_there = command.expected, re.Pattern.fullmatch
    if command.text in DEMO_COMMANDS:
        expected, is_there = f"…\n{expected}", re.Pattern.match
    if not is_there(output_pattern(expected), squeezed(output)):
        pytest.fail(f"{where}: {command.text}\nexpected:\n{command.expected}\nwas:\n{output}", pytrace=False)
