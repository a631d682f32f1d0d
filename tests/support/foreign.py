"""A device description all the way: read, simulated, made into a mapping, booted, served."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from bridge.base.errors import BridgeError
from bridge.canopen.frame import Frame
from bridge.canopen.sdo import Result as SdoResult
from bridge.canopen.sdo import SdoChannel
from bridge.canopen.sdo_transfer import SdoError
from bridge.derive.axis_descriptions import axes_of
from bridge.eds import Description, Entry, read_whole_device_file
from bridge.image import Quality
from bridge.sim.core.nmt_slave import SlaveState
from bridge.sim.generic.generic_eds import plan_of_description
from bridge.sim.generic.generic_node import GenericNode
from tests.support.invented_eds import NODE_ID, DerivedBench

_ANSWER_S = 0.5
_MAKER = range(0x2000, 0x6000)
_HISTORY = 0x1003
"""Object with the sub-indices of what has happened, and nothing has."""
_MOST_SHOWN = 3


@dataclass(frozen=True, slots=True)
class Result:
    """Stage that a file reached; ``problem`` is empty where it is the last. ``findings`` are what could not
    be read of it."""

    name: str
    step: str
    problem: str = ""
    is_drive: bool = True
    findings: tuple[str, ...] = ()

    @property
    def is_device(self) -> bool:
        """True if it is no drive, and not half of one either, of which no mapping is made."""
        return not self.is_drive and not (self.step == "mapping" and "describes no drive" in self.problem)


def served(folder: Path, name: str, content: bytes) -> Result:
    """Result of serving a file: of a drive with CiA 402, or of a device that is no drive."""
    folder.mkdir(parents=True)
    file = folder / "device"
    file.write_bytes(content)
    try:
        description = read_whole_device_file(file)
    except BridgeError as error:
        return Result(name, "read", str(error))
    findings = tuple(str(one) for one in description.findings if one.severity == "error")
    drive = bool(axes_of(description))

    def result(step: str, problem: str = "") -> Result:
        return Result(name, step, problem, drive, findings)

    unlike = simulated(description)
    if unlike:
        return result("simulate", "; ".join(unlike[:_MOST_SHOWN]))
    try:
        bench = DerivedBench(folder, description, source=name)
    except BridgeError as error:
        return result("mapping", str(error))
    status = str(bench.value("conveyor/node/boot_status"))
    if bench.generic.slave.state is not SlaveState.OPERATIONAL:
        return result("boot", status)
    bad = list(_not_served(bench))
    return result("serve", f"{'; '.join(bad[:_MOST_SHOWN])}: {status}") if bad else result("served")


def _not_served(bench: DerivedBench) -> Iterator[str]:
    """A drive's status word that is not good; inputs of a device that are not, without a reason."""
    image = bench.plant.image
    for name in bench.plant.drives:
        point = image.read(f"{name}/status/status_word")
        if point.quality is not Quality.GOOD:
            yield f"the status word is {point.quality.label}"
    for device in (one for node in bench.plant.nodes.values() for one in node.devices):
        for signal in device.family.input:
            point = image.read(f"{device.name}/input/{signal.name}")
            if point.quality is not Quality.GOOD and not point.reason:
                yield f"{signal.name} is {point.quality.label}"


def simulated(description: Description) -> list[str]:
    """Differences between the simulated node and its description: it boots, is started, and is asked for
    every object that can be read."""
    node = GenericNode(NODE_ID, plan_of_description(description, NODE_ID))
    node.start(0.0)
    booted = [frame.can_id for frame in node.take_frames()]
    unlike = [] if 0x700 + NODE_ID in booted else ["it does not report itself"]
    node.on_frame(Frame(0, bytes((1, NODE_ID))), 0.0)
    if node.slave.state is not SlaveState.OPERATIONAL:
        unlike.append("it cannot be started")
    return [*unlike, *_objects_unlike(node, description)]


def _objects_unlike(node: GenericNode, description: Description) -> Iterator[str]:
    channel = SdoChannel(0x600 + NODE_ID, 0x580 + NODE_ID, _ANSWER_S)
    for entry in (entry for one in description.objects for entry in one.entries):
        is_history = entry.index == _HISTORY and entry.sub
        if entry.data_type is None or not entry.access.readable or is_history:
            continue
        results: list[SdoResult] = []
        channel.read(entry.index, entry.sub, 0.0, results.append)
        while frames := channel.take_frames():
            for frame in frames:
                node.on_frame(frame, 0.0)
            for frame in node.take_frames():
                if frame.can_id == channel.reply_id:
                    channel.on_frame(frame)
        place = f"{entry.index:04X}h:{entry.sub:02X} in line {entry.line}"
        if not results:
            yield f"{place} is not answered"
        elif isinstance(results[0], SdoError):
            yield f"{place} cannot be read: {results[0]}"
        elif not _is_default(entry, results[0]):
            yield f"{place} is {results[0].hex()}"


def _is_default(entry: Entry, data: bytes) -> bool:
    """True if an integer of the maker's has the value of the file, as far as it fits the type."""
    plain = entry.current.at(NODE_ID) if entry.current else None
    if entry.index not in _MAKER or type(plain) is not int:
        return True
    return int.from_bytes(data, "little") == plain & ((1 << 8 * len(data)) - 1)


def table(results: Sequence[Result], *, findings: bool = False) -> str:
    """Table of the files that did not come all the way with the reason, and how many did; with ``findings``
    what could not be read of each."""
    lines: list[str] = []
    for one in results:
        if one.problem:
            lines.append(f"{one.name}: {one.step}: {one.problem.removeprefix(f'{one.name} ')}")
        if findings:
            lines += [f"{one.name}: {text}" for text in one.findings]
    for what, those in (
        ("drives", [one for one in results if one.is_drive]),
        ("devices that are no drives", [one for one in results if one.is_device]),
    ):
        if those:
            good = sum(not one.problem for one in those)
            lines.append(f"{good} of {len(those)} {what} are booted and served")
    if half := sum(not one.is_drive and not one.is_device for one in results):
        lines.append(f"{half} files describe half a drive")
    return "\n".join(lines)
