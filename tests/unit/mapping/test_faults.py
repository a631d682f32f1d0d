"""Every fault of a family has its name in both languages, and all that its manual says of it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.drive import FaultWords
from bridge.drive.fault_words import listed_faults
from bridge.mapping import load_family
from bridge.mapping.checks_faults import known_faults
from bridge.mapping.entry_types import Wording
from bridge.mapping.loader import family_names, mappings_dir, read_family
from bridge.mapping.model import Family

FAMILIES = {name: load_family(name) for name in family_names()}
EXPLAINED = {
    # BU 2500 §8.4, both tables
    "nord": "10.2 10.3 10.4 10.8 10.9 100.0 101.0 102.0 103.0 511.0 511.1 511.2 511.3 512.0",
    # EDS84DMOTCAN 3.0 §6.5, §10.3.2, §10.4, §13 (I-1003), and what the bridge finds
    "lenze": "8323074 1000h 3100h 8130h 8150h 8210h 8220h 8700h F000h 10.2 10.3 10.9",
    # ID 441684.06 §9.4.2, and what the bridge finds
    "stoeber": "52.1 52.7 52.8 52.9",
    "cia402": "10.2 10.3 10.9",
}


@pytest.mark.parametrize("name", FAMILIES)
def test_what_the_manual_explains_is_explained(name: str) -> None:
    entries = {one.name: one for one in FAMILIES[name].fault}
    assert sorted(entries) == sorted(EXPLAINED[name.partition("/")[0]].split())
    for one in entries.values():
        assert all((one.en.cause, one.en.remedy, one.de.cause, one.de.remedy)), one.name


DEEDS = {
    "en": r"(?:^|[.;:,] (?:then )?|and )"
    r"(?:check|compare|connect|free|lengthen|let|look|lower|make|measure|note|read|restore|set|switch|warm)\b",
    "de": r"\b(?:abschalten|anschließen|einstellen|erwärmen|freimachen|lassen|lesen|machen|messen|nachsehen"
    r"|notieren|prüfen|senken|verlängern|vergleichen|wiederherstellen)\b",
}
"""Verbs of remedies at the machine, in the imperative or the infinitive."""
DETAILS = {"en": " Details: ", "de": " Genaueres: "}


@pytest.mark.parametrize("language", ["en", "de"])
@pytest.mark.parametrize("name", FAMILIES)
def test_every_remedy_names_something_to_do_and_where_more_is_said_comes_behind(name: str, language) -> None:
    family = FAMILIES[name]
    words = FaultWords(family, language)
    idle = [
        f"{one}: {one.remedy}"
        for one in map(words.listed, listed_faults(family))
        if not re.search(DEEDS[language], one.remedy.partition(DETAILS[language])[0], re.IGNORECASE)
    ]
    assert not idle


@pytest.mark.parametrize("language", ["en", "de"])
@pytest.mark.parametrize("name", FAMILIES)
def test_every_fault_has_a_cause_and_general_advice_says_that_it_is_general(name: str, language) -> None:
    family = FAMILIES[name]
    words, explained = FaultWords(family, language), {one.name for one in family.fault}
    elsewhere = family.faults.elsewhere
    assert elsewhere is not None
    general, possible = {"en": ("General", "Possible"), "de": ("Allgemein", "Möglich")}[language]
    for fault in listed_faults(family):
        one = words.listed(fault)
        assert one.cause, fault
        is_general = fault not in explained
        assert (one.remedy.startswith(general), one.cause.startswith(possible)) == (is_general, is_general)
        assert one.remedy.endswith(f"{getattr(elsewhere, language)}.") is is_general


def test_every_kind_of_advice_is_of_use_to_some_family_and_none_says_what_another_does() -> None:
    faults = [family.faults for family in FAMILIES.values()]
    used = {kind for one in faults for kind in (*one.kinds.values(), one.other_kind)}
    advice = faults[0].advice
    assert set(advice) == used
    remedies = [said.remedy for one in advice.values() for said in (one.en, one.de)]
    assert len(remedies) == len(set(remedies))


@pytest.mark.parametrize("name", [name for name in FAMILIES if not name.startswith("cia402/")])
def test_every_fault_has_a_german_name(name: str) -> None:
    """But for the codes of CiA 402, which the standard has in English."""
    family = FAMILIES[name]
    missing = [one for one in listed_faults(family) if one not in family.faults.german]
    assert not missing


DENIES = {
    "en": r"\b(?:no|not|never|none|nothing|nowhere|without|cannot)\b",
    "de": r"\b(?:kein\w*|nicht|nichts|nie|ohne)\b",
}
"""Words that turn a sentence into its opposite."""
DENIED_OTHERWISE = {
    "Unnötiges darin weglassen": "what it does not need",
    "ein zu bedienender Eingang des Antriebs blieb aus": "that has to be served was not",
    "Die Telegrammübertragung ist fehlerhaft": "Telegrams are not transmitted correctly",
}
"""German that denies by another word what its English denies by one of these."""


def sentences(family: Family) -> Iterator[tuple[str, str]]:
    """English and German of all that a mapping file says in both."""
    known, faults = known_faults(family), family.faults
    yield from ((known[name], german) for name, german in faults.german.items() if name in known)
    for one in (*family.fault, *faults.advice.values()):
        yield one.en.cause, one.de.cause
        yield one.en.remedy, one.de.remedy
    for one in family.parameter:
        yield one.title, one.german or one.title
        yield from ((text, one.german_states.get(code, text)) for code, text in one.states.items())
    for said in (faults.elsewhere, *(one.otherwise for one in (*family.value, *family.meaning))):
        if isinstance(said, Wording):
            yield said.en, said.de


def denies(text: str, language: str) -> bool:
    return re.search(DENIES[language], text, re.IGNORECASE) is not None


def test_what_is_denied_in_one_language_is_denied_in_the_other() -> None:
    pairs = {pair for family in FAMILIES.values() for pair in sentences(family)}
    opposed = {pair for pair in pairs if denies(pair[0], "en") is not denies(pair[1], "de")}
    explained = {
        pair
        for pair in opposed
        if any(english in pair[0] and german in pair[1] for german, english in DENIED_OTHERWISE.items())
    }
    assert opposed == explained
    assert len(explained) == len(DENIED_OTHERWISE)


def changed(folder: Path, more: str) -> Family:
    path = folder / "own.toml"
    path.write_text(f'extends = "stoeber/5000"\n{more}', encoding="utf-8")
    return read_family(path, (folder, mappings_dir()))


@pytest.mark.landing(11)
@pytest.mark.parametrize(
    ("more", "message"),
    [
        ('[[fault]]\nname = "11.1"\n', "there is no fault '11.1'"),
        ('[[fault]]\nname = "eleven"\n', "must be a fault number"),
        ('[faults.german]\n"77" = "x"\n', "there is no fault '77'"),
        ('[[fault]]\nname = "41"\nen.cause = "hot"\n', "has no cause, which en has"),
        ('[[fault]]\nname = "41"\nde.remedy = "kühlen"\n', "has no remedy, which de has"),
        ('[faults.kinds]\n41 = "hot"\n', "faults.advice has no 'hot'"),
        ('[faults]\nother_kind = "odd"\n', "faults.advice has no 'odd'"),
        ('[faults.advice.hot.en]\ncause = "it is hot"\nremedy = "Cool it."\n', "faults.advice.hot.de"),
        ('[faults]\nform = "{shape}"\n', "takes {number}"),
        ('[faults]\nform = "{bits 3-9}"\n', "has no bits"),
        ('[eeprom.save_command]\nparameter = "C01"\nvalue = 1\n', "C01 is no command"),
    ],
)
def test_what_does_not_go_together_is_named(tmp_path: Path, more: str, message: str) -> None:
    with pytest.raises(FileFaults) as caught:
        changed(tmp_path, more)
    assert message in str(caught.value)


def test_a_file_of_ones_own_changes_one_of_them(tmp_path: Path) -> None:
    more = '[[fault]]\nname = "52.1"\nen.remedy = "Call Ann."\nde.remedy = "Ann rufen."\n'
    (one,) = [one for one in changed(tmp_path, more).fault if one.name == "52.1"]
    assert one.en.remedy == "Call Ann."
    assert one.en.cause.startswith("The master sent")
