"""Reads back the outputs of a node that is no drive: whether they have the values that the last stop gives
them.

``command/stop_check/output_check.py`` decides when, and what an answer means. Outputs are read one after the
other, so that other transfers get their turn.
"""

from __future__ import annotations

from functools import partial
from typing import Final

from bridge.base.sdo_texts import text_of_abort
from bridge.canopen import width
from bridge.canopen.sdo import Result, SdoError
from bridge.command.outputs import Outputs
from bridge.command.stop_check.output_check import OutputReadback, Question, StoppedOutput
from bridge.node.places.sdo_channels import FIRST, SdoChannels
from bridge.text import Text

_EXPEDITED: Final = 4
"""Length in bytes with which some servers answer every read of a number. Any other length is another
object."""


class ReadBack:
    """Read-back of one node's outputs. ``now`` is the time of the last frame or timer."""

    def __init__(self, outputs: Outputs, sdo: SdoChannels) -> None:
        self._outputs = outputs
        self._sdo = sdo[FIRST]
        self.now = 0.0

    def next_deadline(self) -> float | None:
        return self._outputs.stop_check.next_reading()

    def on_time(self, now: float) -> None:
        self.now = now
        question = self._outputs.stop_check.question(now)
        if question is not None:
            ref = question.output.object
            self._sdo.read(ref.index, ref.sub, now, partial(self._done, question))

    def _done(self, question: Question, result: Result) -> None:
        self._outputs.on_answer(question, _answer(question.output, result), self.now)


def _answer(output: StoppedOutput, result: Result) -> OutputReadback:
    if isinstance(result, SdoError):
        if result.by_server:
            why = text_of_abort(result.code)
            return OutputReadback(
                None, Text.of("outputs.not_let", output=output.place, why=why, code=result.code)
            )
        return OutputReadback(None, Text.of("outputs.no_answer", output=output.place), was_silent=True)
    size = -(-output.size // 8)
    raw = width.unsigned(result, size)
    is_of_length = len(result) == size or len(result) == _EXPEDITED > size
    if not is_of_length or width.surplus(result, size) or (output.size > 1 and raw >> output.size):
        said = Text.of("outputs.odd_answer", output=output.place, length=len(result), bits=output.size)
        return OutputReadback(None, said)
    return OutputReadback(min(raw, 1) if output.size == 1 else raw)
