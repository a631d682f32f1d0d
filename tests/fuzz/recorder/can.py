"""Recorder of nodes: all that the simulated nodes of the rig send, from power-on to operational."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Final

from tests.fuzz.case import Case, Recorded, save
from tests.fuzz.rig import Rig
from tests.fuzz.targets.can_target import FRAME

_WHAT: Final = {
    0x080: "emergency message",
    0x180: "TPDO1",
    0x280: "TPDO2",
    0x380: "TPDO3",
    0x480: "TPDO4",
    0x580: "SDO answer",
    0x700: "boot-up or heartbeat",
}
_SDO, _RUN, _MOST = 0x580, 6, 12


def record(rig: Rig) -> list[Path]:
    lines = (rig.folder / "frames").read_text(encoding="ascii").splitlines()
    frames = [(int(can_id, 16), bytes.fromhex("".join(data))) for _, can_id, *data in map(str.split, lines)]
    by_node = [frame for frame in frames if frame[0] & 0x780 in _WHAT and frame[0] & 0x7F in range(5, 10)]
    note = "simulated drives of all families: boot-up, configuration, operation"
    return [save("can", "simulated-drives", note, [*_single(by_node), *_runs(by_node)])]


def _single(frames: Iterable[tuple[int, bytes]]) -> list[Recorded]:
    """Each kind of frame once: of TPDOs and states what differs in its first byte, of SDO what does in the
    command and in the object's group."""
    seen: dict[tuple[int, bytes], Recorded] = {}
    counts: dict[int, int] = {}
    for can_id, data in frames:
        function = can_id & 0x780
        key = (can_id, data[:1] + data[2:3] if function == _SDO else data[:1])
        if key not in seen and counts.get(can_id, 0) < _MOST:
            counts[can_id] = counts.get(can_id, 0) + 1
            what = f"{_WHAT[function]} of node {can_id & 0x7F}"
            seen[key] = Recorded(what, Case("frames", (FRAME.pack(can_id) + data,)))
    return list(seen.values())


def _runs(frames: Iterable[tuple[int, bytes]]) -> list[Recorded]:
    """SDO answers as they came one after the other."""
    runs: list[Recorded] = []
    by_id: dict[int, list[bytes]] = {}
    for can_id, data in frames:
        if can_id & 0x780 == _SDO:
            by_id.setdefault(can_id, []).append(FRAME.pack(can_id) + data)
    for can_id, parts in by_id.items():
        for begin in range(0, min(len(parts), 2 * _RUN), _RUN):
            what = f"{_RUN} SDO answers of node {can_id & 0x7F} in their order"
            runs.append(Recorded(what, Case("frames", tuple(parts[begin : begin + _RUN]))))
    return runs
