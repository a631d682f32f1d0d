"""``monitor``: the traffic on a bus, in words. It listens and sends nothing."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from bridge.base import clock
from bridge.base.errors import OperationFailed
from bridge.bustools.decode import Decoder, FrameKind, FrameMeaning
from bridge.bustools.habit_watch import HabitWatch
from bridge.bustools.pdo_views import without_pdos
from bridge.bustools.silence_watch import bounds
from bridge.bustools.statistics import Statistics
from bridge.bustools.task import BusTask
from bridge.canopen.frame import EXTENDED, REMOTE, Frame
from bridge.cli.bus_runner import AsJson, BusChoice, carry_out, choose_bus, print_table, takes_bus, tell
from bridge.cli.terminal import printable
from bridge.cli.trace import SUFFIXES, Trace
from bridge.cli.trace_judge import TraceJudge
from bridge.config import BusTable, load_site
from bridge.lint import family_dictionaries
from bridge.witness.plan import UnknownFamily, WatchedBus, plan

_IDENTIFIER = 0x1FFF_FFFF


class _Listener(BusTask):
    """A task that only listens: decodes, filters, shows, and knows when it is enough."""

    def __init__(
        self,
        decoder: Decoder,
        habits: HabitWatch,
        wanted: Callable[[FrameMeaning], bool],
        show: Callable[[Frame, FrameMeaning, float], None],
        now: float,
        count: int | None,
        seconds: float | None,
    ) -> None:
        super().__init__()
        self.started = now
        self.last = now
        self._decoder = decoder
        self._habits = habits
        self._wanted = wanted
        self._show = show
        self._left = count
        self._until = None if seconds is None else now + seconds

    def is_finished(self, now: float) -> bool:
        self.last = now
        return self._left == 0 or (self._until is not None and now >= self._until)

    def on_frame(self, frame: Frame) -> None:
        # Also what is not shown is decoded: an answer needs the request before it.
        meaning = self._decoder.decode(frame)
        self._habits.on_frame(frame, meaning.node)
        if self._left == 0 or not self._wanted(meaning):
            return
        self._show(frame, meaning, frame.time - self.started)
        if self._left is not None:
            self._left -= 1

    def next_deadline(self) -> float | None:
        return self._until


@takes_bus
def monitor(
    which: BusChoice,
    files: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="[SITE] [TRACE]", help=f"the site file; a recorded trace: {', '.join(SUFFIXES)}"
        ),
    ] = None,
    node: Annotated[list[str] | None, typer.Option(help="only this node; may be repeated")] = None,
    kind: Annotated[list[FrameKind] | None, typer.Option(help="only this kind; may be repeated")] = None,
    count: Annotated[int | None, typer.Option(min=1, help="end after this many frames")] = None,
    seconds: Annotated[float | None, typer.Option(min=0.01, help="end after this time")] = None,
    statistics: Annotated[bool, typer.Option("--statistics", help="count instead, by COB-ID")] = False,
    log: Annotated[Path | None, typer.Option(help="write the frames to a file as candump -L does")] = None,
    as_json: AsJson = False,
) -> None:
    """Decode the frames on a bus until Ctrl-C, --count or --seconds, or those of a recorded trace."""
    site, path = _site_and_trace(files or [])
    line = choose_bus(site, replace(which, channel=None) if path else which, is_recorded=path is not None)
    ids = {line.node_id(text) for text in node or []}
    kinds = set(kind or [])
    descriptions = family_dictionaries(without_pdos(line.families), site)
    decoder = Decoder(line.table.node, line.families, line.own_id, descriptions)
    tally = Statistics(line.table.bitrate)
    habits = HabitWatch(lambda node_id: line.sdo_policy(node_id)[0], decoder.tpdo_bytes)

    def wanted(meaning: FrameMeaning) -> bool:
        return (not ids or meaning.node in ids) and (not kinds or meaning.kind in kinds)

    def show(frame: Frame, meaning: FrameMeaning, at: float) -> None:
        if record:
            record.write(line.table.channel or "can0", frame)
        if statistics:
            tally.on_frame(frame, meaning.label)
        elif as_json:
            print(json.dumps(_for_scripts(frame, meaning, at)), flush=True)
        else:
            print(for_people(frame, meaning, at), flush=True)

    def listen(now: float) -> _Listener:
        return _Listener(decoder, habits, wanted, show, now, count, seconds)

    trace = Trace(path, which.channel, line.table.channel) if path else None
    judge = _judge_of(site, line.table, decoder) if site and trace else None
    with Record(log, is_recorded=trace is not None) if log else nullcontext() as record:
        try:
            listener = _play(trace, listen, judge) if trace else carry_out(line, listen)
        except BrokenPipeError:
            sys.stderr.close()  # whoever read us has had enough, as `head` does
            return
    if statistics:
        _print_statistics(tally, listener.last - listener.started, as_json=as_json)
    for node_id, odd in habits.habits().items():
        tell(f"{decoder.name(node_id)}: {'; '.join(odd)}")
    if judge and not _tell_verdict(judge, listener.last):
        raise typer.Exit(1)


def _judge_of(site: Path, table: BusTable, decoder: Decoder) -> TraceJudge:
    """Judge of a trace of this bus."""
    return TraceJudge(_watched(site, table.name), bounds(table, decoder.rpdos()))


def _tell_verdict(judge: TraceJudge, end: float) -> bool:
    """True if nothing is wrong up to the end of the trace."""
    wrong, right = judge.verdict(end)
    for sentence in (*right, *wrong):
        tell(sentence)
    return not wrong


def _watched(site: Path, bus: str) -> WatchedBus | None:
    """Plan of the witness for the bus; None, which is told, where it does not know its drives."""
    try:
        return next(one for one in plan(load_site(site), site.parent) if one.name == bus)
    except UnknownFamily as error:
        tell(
            f"stops and intruders are not judged: the witness does not know the drives of the mapping {error}"
        )
        return None


def _site_and_trace(files: Sequence[Path]) -> tuple[Path | None, Path | None]:
    """Each is known by its suffix. Raises ``BadParameter`` where there are two of a kind."""
    traces = [path for path in files if path.suffix.lower() in SUFFIXES]
    sites = [path for path in files if path not in traces]
    if len(traces) > 1 or len(sites) > 1:
        raise typer.BadParameter(f"one SITE and one TRACE at most; a trace is {', '.join(SUFFIXES)}")
    return (sites[0] if sites else None), (traces[0] if traces else None)


def _play(trace: Trace, listen: Callable[[float], _Listener], judge: TraceJudge | None) -> _Listener:
    """Everything that was recorded, as if it came now. Raises ``OperationFailed``."""
    listener: _Listener | None = None
    for frame in trace.frames():
        if listener is None:
            listener = listen(frame.time)
        if listener.is_finished(frame.time):
            break
        if judge:
            judge.on_frame(frame, trace.place)
        listener.on_frame(frame)
    assert listener
    if trace.left_out:
        tell(f"left out: {trace.left_out}")
    return listener


def _cob_id(frame: Frame) -> str:
    digits = 8 if frame.can_id & EXTENDED else 3
    return f"{frame.can_id & _IDENTIFIER:0{digits}X}"


def for_people(frame: Frame, meaning: FrameMeaning, at: float) -> str:
    """One line of the monitor."""
    data = "remote" if frame.can_id & REMOTE else frame.data.hex(" ").upper()
    label, text = printable(meaning.label), printable(meaning.text)
    return f"{at:12.6f}  {_cob_id(frame)}  {data:<23}  {label:<22}  {text}".rstrip()


def _for_scripts(frame: Frame, meaning: FrameMeaning, at: float) -> dict[str, object]:
    return {
        "time": round(at, 6),
        "cob_id": _cob_id(frame),
        "remote": bool(frame.can_id & REMOTE),
        "data": frame.data.hex(),
        "kind": meaning.kind,
        "node": meaning.node or None,
        "label": meaning.label,
        "text": meaning.text,
        "values": dict(meaning.values),
    }


class Record:
    """A file of frames as ``candump -L`` writes it. All its methods raise ``OperationFailed``. Recorded ones
    keep their times."""

    def __init__(self, path: Path, *, is_recorded: bool = False) -> None:
        self._path = path
        self._is_recorded = is_recorded
        with self._failing():
            self._file = path.open("w", encoding="ascii")

    def write(self, channel: str, frame: Frame) -> None:
        """One line: time since 1970, interface, frame."""
        remote = bool(frame.can_id & REMOTE)
        data = f"R{len(frame.data) or ''}" if remote else frame.data.hex().upper()
        at = frame.time if self._is_recorded else clock.epoch_ns(frame.time) / 1e9
        with self._failing():
            self._file.write(f"({at:.6f}) {channel} {_cob_id(frame)}#{data}\n")

    def __enter__(self) -> Record:
        return self

    def __exit__(self, *_: object) -> None:
        with self._failing():
            self._file.close()

    @contextmanager
    def _failing(self) -> Generator[None]:
        try:
            yield
        except OSError as error:
            raise OperationFailed(f"{self._path} cannot be written: {error.strerror}") from None


def _print_statistics(tally: Statistics, seconds: float, *, as_json: bool) -> None:
    counts = tally.counts()
    if as_json:
        rows = [
            {
                "cob_id": f"{count.can_id & _IDENTIFIER:03X}",
                "remote": bool(count.can_id & REMOTE),
                "label": count.label,
                "frames": count.frames,
                "frames_per_s": round(count.frames / seconds, 3) if seconds else 0,
                "load_percent": round(tally.load_percent(count, seconds), 3),
                "gap_ms": [round(1000 * gap, 3) for gap in (count.shortest_s, count.mean_s, count.longest_s)],
            }
            for count in counts
        ]
        print(json.dumps({"seconds": round(seconds, 3), "cob_ids": rows}, indent=2))
        return
    table: list[Sequence[str]] = [
        ("COB-ID", "what", "frames", "frames/s", "load %", "gap ms: least", "mean", "most")
    ]
    for count in counts:
        gaps = (f"{1000 * gap:.1f}" for gap in (count.shortest_s, count.mean_s, count.longest_s))
        remote = " R" if count.can_id & REMOTE else ""
        name = f"{count.can_id & _IDENTIFIER:03X}{remote}"
        rate = count.frames / seconds if seconds else 0.0
        load = tally.load_percent(count, seconds)
        table.append((name, count.label, str(count.frames), f"{rate:.1f}", f"{load:.2f}", *gaps))
    print_table(table)
    total = sum(count.frames for count in counts)
    load = sum(tally.load_percent(count, seconds) for count in counts)
    tell(f"{total} frames in {seconds:.1f} s, {load:.1f} % of the bus")
