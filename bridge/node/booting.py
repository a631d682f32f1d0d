"""Runner of a node's boot-up generator: it carries requests to the SDO channel, and the answers back."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from bridge.base.sdo_texts import text_of
from bridge.canopen.dialogue import Dialogue, ask
from bridge.canopen.nmt import NmtState
from bridge.canopen.sdo import Priority, Result, SdoError
from bridge.node import boot
from bridge.node.error_control import ErrorControl
from bridge.node.places.sdo_channels import SdoChannels
from bridge.text import Text

_Dialogue = Dialogue[boot.Action, bytes | None, boot.BootResult, SdoError | boot.BootError]


@dataclass(frozen=True, slots=True)
class _Awaited:
    state: NmtState | None
    deadline: float


class Booted(Protocol):
    """The node that is booted."""

    @property
    def error_control(self) -> ErrorControl: ...

    def may_start(self) -> bool: ...

    def carry_out(self, action: boot.Action, now: float) -> None: ...

    def boot_ended(self, result: boot.BootResult | boot.BootError, now: float) -> None: ...


class Booting:
    """Runner of one boot-up at a time. Answers are kept until ``pump``: the generator never runs inside the
    channel's own bookkeeping."""

    def __init__(self, node: Booted, sdo: SdoChannels) -> None:
        self._node = node
        self._sdo = sdo
        self._dialogue: _Dialogue | None = None
        self._awaited: _Awaited | None = None
        self._goes_on_at: float | None = None
        self._answers: list[Result] = []
        self._step = boot.BootStep(Text.of("boot_step.look"), "B")
        self.is_held = False

    @property
    def is_running(self) -> bool:
        return self._dialogue is not None

    def begin(self, procedure: boot.Boot, now: float) -> None:
        self.cancel(now)
        self._dialogue = Dialogue(procedure, self._waits, self._end, (SdoError, boot.BootError))
        self._go_on(None, now)

    def cancel(self, now: float) -> None:
        """End the boot-up, if there is one, and everything that waits on the SDO channel."""
        if self._dialogue:
            self._dialogue.close()
            self._dialogue = None
        self._awaited = self._goes_on_at = None
        self.is_held = False
        self._sdo.flush(now)
        self._answers.clear()

    def pump(self, now: float) -> None:
        """Resume the boot-up with the answers received since the last call."""
        while self._answers:
            self._go_on(self._answers.pop(0), now)
        if self.is_held and self._node.may_start():
            self.is_held = False
            self._go_on(None, now)

    def on_nmt_state(self, state: NmtState, now: float) -> None:
        """Take a state that the node has reported."""
        if self._awaited and self._awaited.state in (None, state):
            self._awaited = None
            self._go_on(None, now)

    def on_time(self, now: float, state: NmtState) -> None:
        if self._goes_on_at is not None and now >= self._goes_on_at:
            self._goes_on_at = None
            self._go_on(None, now)
        if self._awaited and now >= self._awaited.deadline:
            awaited, self._awaited = self._awaited, None
            if awaited.state is None:
                what = Text.of("boot.nothing_heard", step=self._step.what)
                error = boot.BootError(self._step.letter, _needed(what, self._step))
            else:
                wants, stays = awaited.state.words, state.words
                what = Text.of("boot.stays", state=stays, wanted=wants)
                error = boot.BootError("J", what, absent=False)
            self._go_on(error, now)

    def next_deadline(self) -> float | None:
        return self._awaited.deadline if self._awaited else self._goes_on_at

    def _go_on(self, answer: Result | boot.BootError | None, now: float) -> None:
        """Resume with an answer, or with the outcome of a wait, and run until the boot-up waits again."""
        if self._dialogue is not None:
            self._dialogue.go_on(answer, now)

    def _waits(self, action: boot.Action, now: float) -> bool:
        """Do one step; True where its answer comes later."""
        match action:
            case boot.SdoRead() | boot.SdoWrite():
                ask(action, self._sdo[action.channel], now, self._answers.append, Priority.BOOT)
                return True
            case boot.Await(state, timeout_s):
                if not self._node.error_control.begin_await(state):
                    return False  # without supervision it never says its state
                self._awaited = _Awaited(state, now + timeout_s)
                return True
            case boot.Pause(seconds):
                self._goes_on_at = now + seconds
                return True
            case boot.BootSignal.AWAIT_RELEASE:
                self.is_held = not self._node.may_start()
                return self.is_held
            case boot.BootStep():
                self._step = action
                self._node.carry_out(action, now)
                return False
            case _:
                self._node.carry_out(action, now)
                return False

    def _end(self, result: boot.BootResult | boot.BootError | SdoError, now: float) -> None:
        self._dialogue = None
        if isinstance(result, SdoError):
            result = _failure(result, self._step)
        self._node.boot_ended(result, now)


def _failure(error: SdoError, step: boot.BootStep) -> boot.BootError:
    """Error with which the boot-up ends. Silence says nothing about the object that was asked for."""
    if error.was_answered or step.letter == "B":
        return boot.BootError(step.letter, _needed(text_of(error), step), absent=not error.was_answered)
    what = Text.of("boot.no_answer", why=text_of(error))
    return boot.BootError(step.letter, _needed(what, step), absent=True)


def _needed(what: Text, step: boot.BootStep) -> Text:
    return Text.of("boot.needed", what=what, rule=step.needed_by) if step.needed_by else what
