"""Incidents of the proof, replayed: what the flight recorder has of them comes out again as it was."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple


class Replays(NamedTuple):
    """What came of all recordings: how many there were, with how many outputs, and what differed."""

    recordings: int
    outputs: int
    differences: list[str]


def replay_all(site: Path, state: Path, folder: Path) -> Replays:
    """Replay the ring of a site's service, and what was written out; ``folder`` takes the ring."""
    ring = folder / "ring.recording"
    _drivebridge("record", str(site), "--output", str(ring))
    found = [*sorted((state / "black_box").glob("*.recording")), *([ring] if ring.exists() else [])]
    outputs = 0
    differences: list[str] = []
    for recording in found:
        done = _drivebridge("replay", str(recording), "--json")
        if done.returncode not in (0, 1) or not done.stdout:
            differences.append(f"{recording.name} cannot be replayed: {done.stderr.strip()}")
            continue
        told: list[dict[str, Any]] = json.loads(done.stdout)["segments"]
        outputs += sum(int(one["outputs"]) for one in told)
        differences += [
            f"{recording.name}: segment {one['number']} differs at {one['difference_at_s']:.3f} s: "
            f"{one['difference']}"
            for one in told
            if not one["same"]
        ]
    return Replays(len(found), outputs, differences)


def _drivebridge(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "bridge", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)
