"""A replay has the same outputs as what was recorded, and finds where it has not."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec
import pytest

from bridge.recorder import checkpoint
from bridge.recorder.recording import Segment, notes_of
from bridge.recorder.replay import Difference, Replay
from bridge.recorder.tape import Note, Notes
from tests.plant.plan import Plan, Step
from tests.support.recorded import RecordedPlant

_HEARTBEAT = 0x700
_OUTPUTS = (
    Note.SEND,
    Note.BURST,
    Note.END_BURST,
    Note.ACCEPT,
    Note.WATCH,
    Note.EVENT,
    Note.OUTCOME,
)
_BUSY = (
    Step(1.0, "controller silent", 0, 0.8, ""),
    Step(2.5, "hang", 0, 0.3, "in a turn"),
    Step(4.0, "bus off", 0, 0.4, ""),
    Step(5.5, "stop", 1, 0.0, "stop"),
    Step(6.0, "node reset", 0, 0.0, ""),
    Step(7.0, "intruder", 0, 0.3, "nmt"),
    Step(8.0, "stranger", 2, 0.5, "same host"),
    Step(8.5, "noise", 0, 0.5, "0.2"),
)
"""What may happen in a plant, at times of a recording that begins at 0."""


def plan_from(began_s: float, seconds: float) -> Plan:
    steps = tuple(step._replace(at=step.at + began_s) for step in _BUSY)
    return Plan(7, began_s + seconds + 1, steps)


def played(segment: Segment) -> Replay:
    """A replay up to its end."""
    replay = Replay(segment)
    while replay.step() is not None:
        pass
    return replay


def of_kind(notes: Notes, *kinds: Note) -> list[Any]:
    """The notes of these kinds in a turn."""
    return [note for note in notes[2:] if not isinstance(note, float) and note[0] in kinds]


def outputs_in(segment: Segment) -> int:
    """How many outputs were recorded."""
    return sum(len(of_kind(notes_of(turn), *_OUTPUTS)) for turn in segment.turns)


def test_a_recording_from_the_start_of_the_service_replays(tmp_path: Path) -> None:
    plant = RecordedPlant(tmp_path, plan_from(0.0, 10.0))
    segment = plant.record(10.0)
    replay = played(segment)
    assert replay.turns == len(segment.turns) > 1000
    assert replay.tape.told == outputs_in(segment) > 500


def test_a_recording_from_its_middle_replays(tmp_path: Path) -> None:
    plant = RecordedPlant(tmp_path, plan_from(12.0, 10.0))
    plant.run(11.5)
    plant.run_until_calm()
    segment = plant.record(10.0)
    replay = played(segment)
    assert replay.tape.told == outputs_in(segment) > 500
    image, live = replay.core.view.image, plant.plant.bridge.plant.image
    drive = next(iter(replay.core.plant.drives))
    for leaf in ("status/state", "supervision/owner", "supervision/last_stop", "supervision/trips"):
        name = f"{drive}/{leaf}"
        assert image.read(name)[:3] == live.read(name)[:3], name


def test_the_same_replay_has_the_same_hash(tmp_path: Path) -> None:
    segment = RecordedPlant(tmp_path, plan_from(0.0, 3.0)).record(3.0)
    assert played(segment).tape.hash.digest() == played(segment).tape.hash.digest()


def test_another_output_is_found_where_it_is(tmp_path: Path) -> None:
    segment = RecordedPlant(tmp_path, plan_from(0.0, 3.0)).record(3.0)
    place, notes = next(
        (place, notes)
        for place, notes in enumerate(map(notes_of, segment.turns))
        if place > 100 and of_kind(notes, Note.SEND)
    )
    of_kind(notes, Note.SEND)[0][3] = bytes(8)
    segment.turns[place] = msgspec.msgpack.encode(notes)
    with pytest.raises(Difference, match=r"send can0 .* was recorded, and the replay has send") as found:
        played(segment)
    assert found.value.turn == place + 1


def test_an_input_that_is_left_out_makes_a_difference(tmp_path: Path) -> None:
    segment = RecordedPlant(tmp_path, plan_from(0.0, 3.0)).record(3.0)
    for place, notes in enumerate(map(notes_of, segment.turns)):
        for received in of_kind(notes, Note.FRAMES):
            received[2] = [frame for frame in received[2] if frame[0] & 0x780 != _HEARTBEAT]
        segment.turns[place] = msgspec.msgpack.encode(notes)
    with pytest.raises(Difference):
        played(segment)


def test_there_is_no_checkpoint_in_the_middle_of_a_dialogue(tmp_path: Path) -> None:
    plant = RecordedPlant(tmp_path, plan_from(0.0, 1.0))
    plant.run(0.5)
    while not plant.plant.bridge.master.asks:
        plant.run(0.51)
    with pytest.raises(checkpoint.DialogueIsOn):
        plant.core()
    plant.plant.close()
