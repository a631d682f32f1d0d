"""Stopped words of a node: one for each drive, on every identifier on which it may listen."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from bridge.canopen.frame import Frame
from bridge.canopen.pdo import PdoEntry
from bridge.command import Action, Plant
from bridge.config.download import Download
from bridge.node.boot import BootMemory, rpdo_plan
from bridge.node.process.stop_words import StopWords
from tests.support import sites
from tests.support.judged_plant import JudgedPlant

STOPPED = bytes.fromhex("0004000000000000")
"""BU 2500 §6.5.1: bit 10, control data valid, and no other."""


def plant_of(*drives: str, more: str = "") -> Plant:
    names = drives or ("fu1",)
    tables = [sites.drive(name, "modbus", 200, f"{sites.SCALED}\n{more}") for name in names]
    return sites.plant_of(sites.site(sites.bus(sites.node(*tables)), sites.modbus()))


def words_of(plant: Plant, downloads: Sequence[Download] = (), memory: BootMemory | None = None) -> StopWords:
    return StopWords(plant.nodes["conveyor"], downloads, memory or BootMemory())


def sent(words: StopWords, foreign: Sequence[int] = ()) -> dict[int, bytes]:
    frames: list[Frame] = words.frames({}, lambda can_id: can_id in foreign)
    assert len({frame.can_id for frame in frames}) == len(frames), "one frame to an identifier"
    return {frame.can_id: frame.data for frame in frames}


def test_every_drive_of_the_node_is_told() -> None:
    """BU 2500 §6.4: 200h, 300h, 400h, 500h + node id."""
    found = sent(words_of(plant_of("fu1", "fu2", "fu3", "fu4")))
    assert found == dict.fromkeys((0x205, 0x305, 0x405, 0x505), STOPPED)


def test_the_identifier_of_the_site_file_is_told_beside_that_of_the_factory() -> None:
    found = sent(words_of(plant_of(more="rpdo = { cob_id = 0x385 }")))
    assert found == {0x205: STOPPED, 0x385: STOPPED}


def test_what_the_site_file_switches_off_is_not_told_there() -> None:
    found = sent(words_of(plant_of(more="rpdo = { cob_id = 0x385, enable = false }")))
    assert found == {0x205: STOPPED}


def downloads(cob_id: int) -> list[Download]:
    mapping = [0x3002_0110, 0x3000_0110]
    objects = {(0x1400, 1): cob_id, (0x1600, 0): len(mapping)}
    objects |= {(0x1600, sub): value for sub, value in enumerate(mapping, 1)}
    return [Download(index, sub, value.to_bytes(4, "little")) for (index, sub), value in objects.items()]


def test_a_configured_pdo_is_told_in_its_own_mapping() -> None:
    found = sent(words_of(plant_of(), downloads(0x333)))
    assert found == {0x205: STOPPED, 0x333: bytes.fromhex("00000004")}


@pytest.mark.parametrize("flag", [0x8000_0000, 0x2000_0000])
def test_a_configured_pdo_that_is_off_or_has_29_bits_is_not_told(flag: int) -> None:
    assert sent(words_of(plant_of(), downloads(0x333 | flag))) == {0x205: STOPPED}


def test_what_the_node_has_named_itself_counts_for_its_identifier() -> None:
    plant = plant_of()
    (drive,) = plant.nodes["conveyor"].drives
    memory = BootMemory()
    pdo = drive.slot.rpdo[0]
    plan = rpdo_plan(drive.family, drive.slot, pdo, 0x205, [PdoEntry.from_object(0x3000_0110)])
    memory.note_rpdo(drive.name, pdo.number, plan)
    assert sent(words_of(plant, (), memory)) == {0x205: bytes.fromhex("0004")}


def test_nothing_goes_to_an_identifier_of_another_node() -> None:
    assert sent(words_of(plant_of("fu1", "fu2")), foreign=[0x305]) == {0x205: STOPPED}


def test_the_identifiers_of_the_site_are_its_own() -> None:
    plant = plant_of(more="rpdo = { cob_id = 0x385 }\ntpdo = { cob_id = 0x2C5 }")
    assert words_of(plant, downloads(0x333)).given_ids == {0x385, 0x2C5, 0x333}


class Connected:
    """PDOs of a drive, as far as stopped words ask for them."""

    def __init__(self, can_id: int = 0x205) -> None:
        self._can_id = can_id

    def frames_with(self, words: Sequence[int]) -> list[Frame]:
        return [Frame(self._can_id, words[0].to_bytes(2, "little"))]


def connected_words(line: JudgedPlant) -> dict[int, bytes]:
    words = StopWords(line.plant.nodes["conveyor"], (), BootMemory())
    pdos: dict[str, Connected] = {line.drive.name: Connected()}
    frames = words.frames(pdos, lambda can_id: False)  # pyright: ignore[reportArgumentType]
    return {frame.can_id: frame.data[:2] for frame in frames}


def test_what_stops_a_drive_at_present_is_repeated_and_may_be_a_ramp() -> None:
    line = JudgedPlant().enables()
    line.asks(Action.STOP)
    word = line.drive.channel.output.words[0]
    assert connected_words(line) == {0x205: word.to_bytes(2, "little")}


def test_a_drive_that_is_enabled_gets_a_stopped_word_and_not_its_own() -> None:
    assert connected_words(JudgedPlant().enables()) == {0x205: STOPPED[:2]}
