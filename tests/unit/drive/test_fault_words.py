"""A fault is written as its maker writes it, and comes with what the manual says of it."""

from __future__ import annotations

import pytest

from bridge.drive import FaultWords
from bridge.mapping import load_family

NORD, LENZE = load_family("nord/sk-tu4-cao"), load_family("lenze/8400-motec")
STOEBER, CIA402 = load_family("stoeber/5000"), load_family("cia402/velocity")


@pytest.mark.parametrize(
    ("family", "number", "written"),
    [
        # BU 2500 §8.4: the group E010, then 10.3
        (NORD, 3.0, "E003/3.0 overcurrent of the inverter"),
        (NORD, 10.4, "E010/10.4 initialisation fault of the external bus interface"),
        (NORD, 25.4, "E025/25.4 universal encoder fault"),
        (NORD, 99.9, "E099/99.9"),
        (NORD, 102.0, "102.0 bus time-out P151"),  # of the interface, which has no group
        # EDS84DMOTCAN 3.0 §6.5; the type is how the drive is set to react
        (LENZE, 0x047F_0002, "01.0127.00002 CE04: communication error of the MCI"),
        (LENZE, 0x087F_0002, "02.0127.00002 CE04: communication error of the MCI"),
        # Lenze's reference manual, DMS 4.1 EN, §9.8.1.4
        (LENZE, 75169803, "01.0123.00011"),
        (LENZE, 10.3, "10.3 the controller fell silent"),  # the bridge's own
        (STOEBER, 41.0, "41 temperature of the motor, sensor"),
        (STOEBER, 99.0, "99"),
        (CIA402, 0x8611, "8611h following error"),
        (CIA402, 0x8799, "8799h SYNC controller"),  # by its group
    ],
)
def test_a_number_is_in_the_makers_form(family, number: float, written: str) -> None:
    assert str(FaultWords(family).of_drive(number)) == written


def test_a_cause_comes_with_its_event() -> None:
    """ID 441684.06 §9.4.2: 52:Kommunikation with the cause 1:Error Control."""
    words = FaultWords(STOEBER)
    known, unknown = words.of_drive(52, 1), words.of_drive(41, 2)
    assert str(known) == "52 communication: life guarding (error control), cause 1"
    assert "A203 × A204" in known.remedy
    assert str(unknown) == "41 temperature of the motor, sensor, cause 2"


def test_cause_and_remedy_are_there_in_both_languages() -> None:
    english, german = FaultWords(NORD).own(10.3), FaultWords(NORD, "de").own(10.3)
    assert (english.number, german.number) == ("E010/10.3", "E010/10.3")
    assert "enable bit" in english.cause
    assert "Freigabe-Bit" in german.cause
    assert german.text == "Time-out durch P151/P513: Die Steuerung schweigt"


def test_where_the_manual_explains_nothing_there_is_general_advice_and_where_more_is_said() -> None:
    one, german = FaultWords(NORD).of_drive(3.0), FaultWords(NORD, "de").of_drive(3.0)
    assert one.cause.startswith("Possible causes: the load is too heavy")
    assert one.remedy.startswith("General advice: Check that the machine moves freely")
    assert "BU 0200" in one.remedy
    assert german.remedy.startswith("Allgemeiner Rat: Leichtgängigkeit")
    assert german.remedy.endswith("BU 2500 §8.3.3 nennt nur den Namen.")


@pytest.mark.parametrize(
    ("family", "code", "advised"),
    [
        (CIA402, 0x2340, "insulation"),  # the code
        (CIA402, 0x2311, "ramp"),  # its group 23xxh is no kind, the class 20xxh is
        (CIA402, 0x7308, "encoder"),  # its group
        (NORD, 0x5110, "terminating"),  # NORD: fault of the external bus; CiA: low voltage (§8.3.3)
        (CIA402, 0x5110, "24 V"),
        (CIA402, 0xFF77, "ask the maker"),  # nobody knows it
    ],
)
def test_advice_is_by_the_code_else_by_its_group_else_by_its_class(family, code: int, advised: str) -> None:
    assert advised in FaultWords(family).of_code(code).remedy


def test_a_number_that_no_list_has_comes_with_advice_too() -> None:
    one = FaultWords(LENZE).of_drive(75169803)
    assert not one.text
    assert "Engineer" in one.remedy


def test_no_fault_is_in_need_of_no_advice() -> None:
    """ID 441684.06 §9.3: event 30 says that there is none any more."""
    assert not FaultWords(CIA402).of_code(0).remedy
    assert not FaultWords(STOEBER).of_drive(30).remedy


def test_a_cause_takes_the_advice_of_its_event() -> None:
    assert "Let the motor cool down" in FaultWords(STOEBER).of_drive(41, 2).remedy


def test_an_emergency_code_is_explained_too() -> None:
    one = FaultWords(LENZE, "de").of_code(0x8210)
    assert str(one) == "8210h PDO kürzer als erwartet"
    assert "verworfen" in one.cause


def test_a_code_that_stands_for_numbers_of_the_drive_has_their_german() -> None:
    words = FaultWords(NORD, "de")
    said = "4.0/4.1 Überstrom Modul"
    assert str(words.of_code(0x2200)) == f"2200h {said}"
    assert words.code_text(0x2200) == said
    assert words.code_text(0x5001) == "hardware"  # by its group, which has no number
