"""Findings of the linter: like faults of a file, with a severity."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from bridge.base.errors import Fault, FileFaults
from bridge.text import Said, Text
from bridge.tomlfile import Key, TomlFile, dotted


class Severity(StrEnum):
    ERROR = "error"
    """The site cannot work."""
    WARNING = "warning"
    """The site can work, but deserves a second look."""


@dataclass(frozen=True, slots=True)
class LintFinding:
    severity: Severity
    fault: Fault

    def __str__(self) -> str:
        return f"{self.severity}: {self.fault}"


class LintReport:
    """Collects findings with the lines of the site file at ``path``."""

    def __init__(self, path: Path) -> None:
        self._path = str(path)
        self._findings: list[LintFinding] = []
        try:
            self._file = TomlFile(path)
        except FileFaults:  # the file has gone since it was loaded: its content still counts
            self._file = None

    def error(self, key: Key, said: Text, advice: Said = "") -> None:
        self._add(Severity.ERROR, key, said, advice)

    def warning(self, key: Key, said: Text, advice: Said = "") -> None:
        self._add(Severity.WARNING, key, said, advice)

    def _add(self, severity: Severity, key: Sequence[int | str], said: Text, advice: Said) -> None:
        line = self._file.line(key) if self._file else 0
        fault = Fault(self._path, line, dotted(key), said, advice)
        self._findings.append(LintFinding(severity, fault))

    def findings(self) -> tuple[LintFinding, ...]:
        """Findings in the order of the file."""
        return tuple(sorted(self._findings, key=lambda finding: finding.fault.line))
