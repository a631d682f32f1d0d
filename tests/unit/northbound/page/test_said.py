"""Sentences of the bridge itself, in German on the page: nobody adds a message without its phrase."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest

from bridge.canopen import abort
from bridge.canopen.sdo_ways_back import WAYS_BACK
from bridge.command.link import NodeState
from bridge.command.messages.request import Code
from bridge.drive import DriveState
from bridge.mapping import emcy_codes
from tests.support.phrases import SLOT, Book, is_looked_up, read
from tests.support.said import WORD, WORDS, texts_of

FILE: Final = Path("bridge/northbound/page/static/js/texts/said-de.json")
PAIRS: Final = read(FILE)
BOOK: Final = Book(PAIRS)

COVERED: Final = (
    "bridge/command",
    "bridge/node",
    "bridge/master",
    "bridge/drive",
    "bridge/parameter",
    "bridge/mirror/client.py",
    "bridge/mirror/publisher.py",
    "bridge/northbound/page/bus.py",
    "bridge/northbound/page/viewer.py",
    "bridge/northbound/page/parameters.py",
    "bridge/canopen/abort.py",
    "bridge/canopen/datatypes.py",
    "bridge/canopen/pdo.py",
    "bridge/canopen/sdo_transfer.py",
    "bridge/can/listener.py",
    "bridge/lint",
    "bridge/mapping/device.py",
    "bridge/mapping/emcy_codes.py",
    "bridge/service/parts.py",
    "bridge/service/plant_condition.py",
    "bridge/service/front_process.py",
    "bridge/service/page/buses.py",
)
APART: Final = (
    "bridge/lint/report.py",
    "bridge/command/points.py",  # descriptions of points
    "bridge/command/leg/state.py",  # what its states mean, for the documentation
    "bridge/command/leg/table.py",
    "bridge/command/leg/words.py",
    "bridge/command/stop_check/state.py",
    "bridge/command/stop_check/table.py",
    "bridge/drive/fault_words.py",  # in both languages itself
    "bridge/master/ending.py",  # the log's last lines
    "bridge/parameter/error.py",
    "bridge/parameter/backup_file.py",  # the command line and its files
    "bridge/parameter/backups.py",
    "bridge/parameter/ledger_file.py",
    "bridge/parameter/number_text.py",
    "bridge/parameter/set_file.py",
)
UNSAID: Final[dict[str, tuple[str, ...]]] = {
    "bridge/command/messages/event.py": ("Zq zq (because: 7Xq)",),
    "bridge/command/plant.py": ("Zq zq on 7Xq",),
    "bridge/command/worst_case.py": (
        "how much older the owner's last telegram may be than the bridge assumes",
    ),
    "bridge/drive/meaning.py": ("7Xq of  Zq zq",),
    "bridge/drive/own_supervision.py": ("7Xq = 7Xq ms", "7Xq × 100D:00 = 7Xq ms × 7Xq"),
    "bridge/master/master.py": ("the master has failed: Zq zq",),
    "bridge/master/watch.py": ("master", "stranger 7Xq", "duplicate 7Xq"),
    "bridge/mirror/publisher.py": ("Zq zq (is this site already being run?)",),
    "bridge/northbound/page/bus.py": ("seconds = 1…7Xq, format = 7Xq",),
    "bridge/northbound/page/viewer.py": ("bus 7Xq", "visitor#7Xq"),
    "bridge/lint/contradictions.py": ("7Xq, which is 7Xq,",),
    "bridge/lint/own.py": (
        "RPDO periods",
        ", and sdo_channels = 7Xq, over which their own parameters are reached",
    ),
    "bridge/parameter/ledger.py": ("10 min",),
    "bridge/parameter/names.py": ("parameter set",),
    "bridge/service/front_process.py": ("the bus process has given this front up",),
    "bridge/service/parts.py": ("7Xq; not served: 7Xq",),
}
"""Texts that are no message on the page: keys, logs, and parts of messages that are tested as a whole."""
_COMMAND: Final = re.compile(r"(?:modprobe|ip link) .*")
_ELSEWHERE: Final = re.compile(
    "attachment; filename=|.*(predicted load .* kbit/s|dead controller|dead bridge)"
)
"""Heads of answers, and what the check says on the command line alone."""
_WORD: Final = re.compile(r"(?<![\w/.{-])[a-z]{3,}(?![\w/.}-])")
_ENGLISH: Final = (" the ", " is ", " of ", " and ", " not ", " has ", " by ", " with ", " are ", " it ")


def files() -> Iterator[Path]:
    for name in COVERED:
        path = Path(name)
        for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
            if str(file) not in APART:
                yield file


def lacking(sample: str) -> list[str]:
    """The parts of a text that no phrase is for and that are more than what is filled in."""
    BOOK.said(sample)
    return [part for part in BOOK.unknown if _is_english(part)]


def _is_english(part: str) -> bool:
    return not _COMMAND.fullmatch(part) and bool(_WORD.search(part.replace(WORDS, "").replace(WORD, "")))


@pytest.mark.parametrize("file", list(files()), ids=str)
def test_each_message_has_a_german_phrase(file: Path) -> None:
    apart = UNSAID.get(str(file), ())
    missing = {
        f"{text.line}: {part}"
        for text in texts_of(file)
        if text.sample not in apart and not _ELSEWHERE.match(text.sample)
        for part in lacking(text.sample)
    }
    assert not missing, "texts/said-de.json has no phrase for\n" + "\n".join(sorted(missing))


def test_each_word_that_stands_in_messages_has_one() -> None:
    words = [
        *(state.value for state in NodeState),
        *(state.label.replace("_", " ") for state in DriveState),
        *(str(code) for code in Code),
        *abort.TEXTS.values(),
        *emcy_codes.register_text(0xBF).split(", "),
    ]
    known = {english for english, _ in PAIRS}
    assert [word for word in words if word not in known and word.partition(": ")[0] not in known] == []


def test_both_sides_have_the_same_slots() -> None:
    for english, german in PAIRS:
        slots = [match[0] for match in SLOT.finditer(english)]
        assert len(set(slots)) == len(slots), english
        assert sorted(slots) == sorted(match[0] for match in SLOT.finditer(german)), english


def test_no_phrase_is_there_twice() -> None:
    english = [
        SLOT.sub(lambda slot: "{…}" if is_looked_up(slot[1]) else f"{{{slot[2]}}}", one) for one, _ in PAIRS
    ]
    assert [one for one in set(english) if english.count(one) > 1] == []


def test_no_phrase_hides_a_later_one() -> None:
    def sample(slot: re.Match[str]) -> str:
        return WORDS if is_looked_up(slot[1]) or slot[2] == "…" else WORD

    hidden = []
    for phrase in BOOK.slotted:
        found = BOOK.first(SLOT.sub(sample, phrase.english))
        if found is not phrase:
            hidden.append((phrase.english, found and found.english))
    assert hidden == []


def test_no_phrase_holds_what_texts_are_split_at() -> None:
    assert [english for english, _ in PAIRS if "; " in english] == []


def test_german_is_german() -> None:
    for english, german in PAIRS:
        bare = f" {SLOT.sub('', german)} "
        assert not [word for word in _ENGLISH if word in bare], german
        assert german == german.strip() and "<" not in german, german
        assert english == english.strip()


@pytest.mark.parametrize(
    ("said", "german"),
    [
        (
            "P102: 2066h:01: no valid answer: SDO protocol timed out (05040000h)",
            "P102: 2066h:01: keine gültige Antwort: Zeitüberschreitung im SDO-Protokoll (05040000h)",
        ),
        ("what nobody has written down yet", "what nobody has written down yet"),
        ("", ""),
    ],
)
def test_texts_are_put_together_from_phrases(said: str, german: str) -> None:
    assert BOOK.said(said) == german


def test_each_way_back_from_block_transfer_has_its_german_phrase() -> None:
    for way in WAYS_BACK:
        assert lacking(way.says) == []
