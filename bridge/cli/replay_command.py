"""``replay``: a recording through the same core, on the clock of the recording."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from bridge.base.errors import OperationFailed
from bridge.cli.bus_runner import AsJson
from bridge.cli.terminal import printable
from bridge.image import Image, Quality, Reading
from bridge.recorder.core_names import Unusable
from bridge.recorder.recorder import fingerprint
from bridge.recorder.recording import Segment, read
from bridge.recorder.replay import Difference, Replay
from bridge.recorder.told import epoch_at, lines_of_turn

_OF_A_DRIVE: Final = (
    "status/state",
    "status/drive_status_word",
    "supervision/owner",
    "supervision/watchdog_state",
    "supervision/sent_control_word",
    "supervision/restart_interlock",
    "supervision/follows",
    "supervision/last_stop",
    "supervision/current_fault",
)
_WORDS: Final = ("drive_status_word", "sent_control_word")


def replay(
    file: Annotated[Path, typer.Argument(metavar="RECORDING", help="a recording")],
    until: Annotated[
        float | None,
        typer.Option(min=0, help="end after so many seconds, and print the state of every drive then"),
    ] = None,
    step: Annotated[bool, typer.Option("--step", help="print what happens in each turn")] = False,
    as_json: AsJson = False,
) -> None:
    """Replay a recording, and compare all that comes out of it with what was recorded."""
    segments = [one for one in read(file) if one.state is not None]
    if not segments:
        raise OperationFailed(f"{file} has no checkpoint from which it could be replayed")
    own = fingerprint()
    others = {one.header.version for one in segments if one.state and one.state.code != own}
    if others:
        versions = ", ".join(sorted(others))
        raise OperationFailed(
            f"{file} is of another program (version {versions}): only the same one, on the same Python, "
            "replays it; `drivebridge record` exports it all the same"
        )
    began, spent = segments[0].header.began, time.monotonic()
    told: list[dict[str, Any]] = []
    for segment in segments:
        if until is not None and segment.header.began > began + until:
            break
        told.append(_play(segment, None if until is None else began + until, step=step))
    spent = time.monotonic() - spent
    same = all(one["same"] for one in told)
    if as_json:
        print(json.dumps({"same": same, "segments": told}, indent=2))
    else:
        for one in told:
            _print(one)
        seconds = sum(one["seconds"] for one in told)
        print(f"{seconds:.1f} s replayed, {seconds / max(spent, 1e-3):.0f} times as fast", file=sys.stderr)
    if not same:
        raise typer.Exit(1)


def _play(segment: Segment, until: float | None, *, step: bool) -> dict[str, Any]:
    """Play a segment; returns what there is to tell."""
    try:
        played = Replay(segment)
    except Unusable as error:
        raise OperationFailed(f"segment {segment.header.number} cannot be replayed: {error}") from None
    difference: Difference | None = None
    try:
        while (until is None or played.time <= until) and (notes := played.step()) is not None:
            if step:
                for line in lines_of_turn(segment, notes):
                    facts = " ".join(str(fact) for name, fact in line.items() if name != "what")
                    at = played.time - segment.header.began
                    print(printable(f"{at:12.6f}  {line['what']:<16}  {facts}"))
    except Difference as found:
        difference = found
    told: dict[str, Any] = {
        "number": segment.header.number,
        "began": epoch_at(segment, segment.header.began),
        "seconds": played.time - segment.header.began,
        "turns": played.turns,
        "outputs": played.tape.told,
        "hash": played.tape.hash.hexdigest(),
        "same": difference is None,
    }
    if difference:
        told["difference"] = str(difference)
        told["difference_at_s"] = difference.time - segment.header.began
    if until is not None and (difference or played.time > until or played.turns == len(segment.turns)):
        told["state"] = _state(played.core.view.image, played.core.plant.drives)
    return told


def _state(image: Image, drives: Iterable[str]) -> dict[str, dict[str, Any]]:
    """The state of the drives, by point."""
    return {
        drive: {leaf: _shown(leaf, image.read(f"{drive}/{leaf}")) for leaf in _OF_A_DRIVE} for drive in drives
    }


def _shown(leaf: str, reading: Reading) -> object:
    if reading.quality is not Quality.GOOD:
        return reading.reason or reading.quality.label
    is_word = leaf.endswith(_WORDS) and isinstance(reading.value, int)
    return f"{reading.value:04X}" if is_word else reading.value


def _print(told: dict[str, Any]) -> None:
    verdict = "as recorded" if told["same"] else f"DIFFERS at {told['difference_at_s']:.6f} s"
    print(
        f"segment {told['number']}: {told['seconds']:.1f} s, {told['turns']} turns, "
        f"{told['outputs']} outputs: {verdict}, {told['hash'][:16]}"
    )
    if "difference" in told:
        print(printable(f"  {told['difference']}"))
    for drive, points in told.get("state", {}).items():
        print(drive)
        for leaf, value in points.items():
            print(printable(f"  {leaf:<32}{value}"))
