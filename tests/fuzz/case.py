"""Cases to be thrown, the corpus of recorded messages, and files that repeat a failure."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple

CORPUS: Final = Path(__file__).parent / "corpus"


class Case(NamedTuple):
    """One message, or some that belong together. ``kind`` says to the target how ``parts`` are thrown."""

    kind: str
    parts: tuple[bytes, ...]

    def as_line(self) -> str:
        return json.dumps({"kind": self.kind, "parts": [part.hex() for part in self.parts]})

    @classmethod
    def from_line(cls, line: str) -> Case:
        found = json.loads(line)
        return cls(found["kind"], tuple(bytes.fromhex(part) for part in found["parts"]))


@dataclass(frozen=True, slots=True)
class Recorded:
    """A message of a real client. ``what`` says what it is."""

    what: str
    case: Case


class Corpus:
    """Recorded messages of one protocol, by their kind."""

    def __init__(self, recorded: Iterable[Recorded]) -> None:
        self.recorded = tuple(recorded)
        self._by_kind: dict[str, list[Case]] = {}
        for one in self.recorded:
            self._by_kind.setdefault(one.case.kind, []).append(one.case)

    def of(self, kind: str) -> Sequence[Case]:
        """All of this kind. Raises ``LookupError`` where there are none: a fuzzer without messages tests
        nothing."""
        return self._by_kind[kind]

    def parts(self, kind: str) -> list[bytes]:
        return [part for case in self.of(kind) for part in case.parts]


def load(protocol: str) -> Corpus:
    """All files of a protocol; each has what one client said."""
    recorded: list[Recorded] = []
    for path in sorted((CORPUS / protocol).glob("*.json")):
        for found in json.loads(path.read_text(encoding="utf-8"))["messages"]:
            parts = tuple(bytes.fromhex(part) for part in found["parts"])
            recorded.append(Recorded(found["what"], Case(found["kind"], parts)))
    return Corpus(recorded)


def save(protocol: str, client: str, note: str, recorded: Sequence[Recorded]) -> Path:
    """One message a line, so that a change of the corpus can be read."""
    path = CORPUS / protocol / f"{client}.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = [
        json.dumps(
            {"what": one.what, "kind": one.case.kind, "parts": [part.hex() for part in one.case.parts]},
            ensure_ascii=False,
        )
        for one in recorded
    ]
    body = ",\n".join(lines)
    text = f'{{"client": {json.dumps(client)}, "note": {json.dumps(note)}, "messages": [\n{body}\n]}}\n'
    path.write_text(text, encoding="utf-8")
    return path


def write_cases(path: Path, cases: Iterable[Case]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("".join(f"{case.as_line()}\n" for case in cases), encoding="ascii")


def read_cases(path: Path) -> list[Case]:
    return [Case.from_line(line) for line in path.read_text(encoding="ascii").splitlines()]
