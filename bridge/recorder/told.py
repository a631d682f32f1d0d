"""Contents of a recording: its frames, and everything in it as lines for scripts. Pure."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import msgspec

from bridge.base.errors import OperationFailed
from bridge.base.turns import Turn
from bridge.canopen.frame import Frame
from bridge.command import Event
from bridge.mirror import protocol
from bridge.mirror.protocol import Answered, Connected, Rejected
from bridge.recorder.recording import Segment, notes_of
from bridge.recorder.tape import Note, Notes

Line = dict[str, Any]


class TracedFrame(NamedTuple):
    """A frame of a recording, with its time in seconds since 1970. ``is_ours``: the bridge has handed it over
    to be sent."""

    bus: str
    frame: Frame
    is_ours: bool


@contextmanager
def _readable() -> Generator[None]:
    """Raise ``OperationFailed`` for notes that are not as a tape makes them."""
    try:
        yield
    except (TypeError, ValueError, LookupError, AttributeError, ArithmeticError) as error:
        raise OperationFailed(f"a turn that cannot be read: {error}") from None


def epoch_at(segment: Segment, at: float) -> float:
    """A monotonic time of a segment as seconds since 1970, by the wall clock at its beginning."""
    return segment.header.epoch_ns / 1e9 + at - segment.header.began


def frames_of(segments: list[Segment]) -> Iterator[TracedFrame]:
    """The frames of a recording, in the order in which the bridge had them. What the kernel repeats is there
    each time it becomes another frame. Raises ``OperationFailed``."""
    with _readable():
        yield from _frames_of(segments)


def _frames_of(segments: list[Segment]) -> Iterator[TracedFrame]:
    repeated: dict[tuple[str, int], list[Any]] = {}
    for segment in segments:
        for turn in segment.turns:
            now = segment.header.began
            for note in notes_of(turn)[2:]:
                match note:
                    case float():
                        now = note
                    case [Note.FRAMES | Note.FOREIGN, bus, frames]:
                        for can_id, data, at in frames:
                            yield TracedFrame(bus, Frame(can_id, data, epoch_at(segment, at)), is_ours=False)
                    case [Note.SEND, bus, can_id, data]:
                        yield TracedFrame(bus, Frame(can_id, data, epoch_at(segment, now)), is_ours=True)
                    case [Note.BURST, bus, [frames, *_], _]:
                        key = bus, frames[0][0]
                        if repeated.get(key) != frames:
                            repeated[key] = frames
                            for can_id, data, _ in frames:
                                frame = Frame(can_id, data, epoch_at(segment, now))
                                yield TracedFrame(bus, frame, is_ours=True)
                    case [Note.END_BURST, bus, can_id]:
                        repeated.pop((bus, can_id), None)
                    case _:
                        pass


def lines_of(segments: list[Segment]) -> Iterator[Line]:
    """Everything in a recording but the looks at the clock, a line each. Raises ``OperationFailed``."""
    with _readable():
        yield from _lines_of(segments)


def _lines_of(segments: list[Segment]) -> Iterator[Line]:
    for segment in segments:
        number = segment.header.number
        yield {"t": epoch_at(segment, segment.header.began), "what": "segment", "number": number}
        now = segment.header.began
        for place, turn in enumerate(segment.turns, 1):
            kind, arguments, *notes = notes_of(turn)
            now = next((note for note in notes if isinstance(note, float)), now)
            for line in _turn_lines(kind, arguments):
                yield {"t": epoch_at(segment, now), "turn": place, **line}
            for note in notes:
                if isinstance(note, float):
                    now = note
                    continue
                for line in _note_lines(segment, note):
                    yield {"t": epoch_at(segment, now), "turn": place, **line}


def lines_of_turn(segment: Segment, notes: Notes) -> Iterator[Line]:
    """Lines of one turn."""
    kind, arguments, *rest = notes
    yield from _turn_lines(kind, arguments)
    for note in rest:
        if not isinstance(note, float):
            yield from _note_lines(segment, note)


def _turn_lines(kind: str, arguments: list[Any]) -> Iterator[Line]:
    match Turn(kind), arguments:
        case Turn.SUBMIT, [asked, number]:
            request, _ = protocol.decode_request(asked)
            yield {
                "what": "request",
                "number": number,
                "source": request.identity.source.label,
                "user": request.identity.user,
                "target": request.target,
                "action": request.action,
                "command": msgspec.to_builtins(request.command),
                "received_at": request.received_at,
            }
        case Turn.REJECTED, [told, _]:
            one = protocol.decode(Rejected, told)
            yield {
                "what": "rejected",
                "target": one.rejection.target,
                "action": one.rejection.action,
                "code": one.rejection.code,
                "count": one.count,
            }
        case Turn.CONNECTION, [told]:
            other = protocol.decode(Connected, told)
            yield {"what": "connection", "user": other.identity.user, "is_there": other.is_there}
        case Turn.HALT | Turn.STOP_NODES, _:
            yield {"what": kind}
        case _:
            pass


def _note_lines(segment: Segment, note: Any) -> Iterator[Line]:
    match note:
        case [Note.FRAMES | Note.FOREIGN as kind, bus, frames]:
            what = "received" if kind == Note.FRAMES else "foreign"
            for can_id, data, at in frames:
                yield {
                    "what": what,
                    "bus": bus,
                    "frame": repr(Frame(can_id, data)),
                    "at": epoch_at(segment, at),
                }
        case [Note.SEND, bus, can_id, data]:
            yield {"what": "sent", "bus": bus, "frame": repr(Frame(can_id, data))}
        case [Note.BURST, bus, [frames, period_s, total, ending], at_once]:
            yield {
                "what": "repeated",
                "bus": bus,
                "frames": [repr(Frame(*frame)) for frame in frames],
                "period_s": period_s,
                "total": total,
                "then": repr(Frame(*ending[1])) if ending and ending[1] else None,
                "at_once": at_once,
            }
        case [Note.END_BURST, bus, can_id]:
            yield {"what": "repeated_no_more", "bus": bus, "cob_id": f"{can_id:03X}"}
        case [Note.EVENT, told]:
            event = protocol.decode(Event, told)
            yield {
                "what": "event",
                "kind": event.kind,
                "source": event.source,
                "severity": event.severity,
                "message": event.message,
            }
        case [Note.OUTCOME, number, told]:
            outcome = protocol.decode(Answered, told).outcome
            yield {
                "what": "outcome",
                "number": number,
                "code": outcome.code,
                "forwarded": outcome.forwarded,
                "message": outcome.message,
            }
        case [Note.TURN, kind, arguments]:
            yield from _turn_lines(kind, arguments)
        case [Note.FAULT | Note.SLEPT | Note.RANG as kind, fact]:
            yield {"what": kind, "value": fact}
        case _:
            pass
