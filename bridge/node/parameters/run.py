"""Runner of procedures that read and write parameters on SDO channels. Sans-IO."""

from __future__ import annotations

from collections.abc import Callable, Generator
from functools import partial
from typing import TypeVar

from bridge.base.sdo_texts import text_of
from bridge.canopen.dialogue import Dialogue
from bridge.canopen.sdo import Priority, Result, SdoChannel, SdoError
from bridge.parameter import ParameterError, Transfer, TransferFailed, Why
from bridge.text import Text

T = TypeVar("T")
Procedure = Generator[Transfer, tuple[bytes, float], T]
ChannelFor = Callable[[Transfer], SdoChannel]


def run(
    procedure: Procedure[T],
    channel_for: ChannelFor,
    clock: Callable[[], float],
    done: Callable[[T | ParameterError], None],
    *,
    priority: Priority = Priority.COMMAND,
) -> None:
    """Run ``procedure``; ``done`` is called once with its result or the reason of its failure, possibly
    before this returns.

    ``clock`` gives the latest known time in monotonic seconds. A value is as old as the request that read it.
    """
    refused: list[Text] = []
    """Reason why the write that is under way was not begun, if any."""

    def carry_out(transfer: Transfer, now: float) -> bool:
        index, sub = transfer.address.index, transfer.address.sub
        concluded = partial(conclude, now)
        channel = channel_for(transfer)
        if transfer.data is None:
            channel.read(index, sub, now, concluded, priority=priority)
            return True

        def may_begin() -> bool:
            if transfer.why_not is not None:
                refused[:] = filter(None, [transfer.why_not()])
            return not refused

        # Not repeated without an answer: an EEPROM is written once, and read to see whether it was.
        channel.write(
            index,
            sub,
            transfer.data,
            now,
            concluded,
            priority=priority,
            repeatable=False,
            may_begin=may_begin,
        )
        return True

    def conclude(asked: float, result: Result) -> None:
        if refused:
            dialogue.go_on(ParameterError(Why.PROTECTED, refused.pop()), clock())
        elif isinstance(result, SdoError):
            failure = TransferFailed(text_of(result), result.code, by_drive=result.by_server)
            dialogue.go_on(failure, clock())
        else:
            dialogue.go_on((result, asked), clock())

    dialogue = Dialogue(procedure, carry_out, lambda end, now: done(end), (ParameterError,))
    dialogue.go_on(None, clock())
