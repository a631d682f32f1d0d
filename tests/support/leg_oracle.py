"""Oracle of the controller leg of one drive: what must hold after each step, whatever has happened."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from tests.support.leg_rules import MOVING, Model
from tests.support.leg_seen import Missing
from tests.support.leg_words import STRENGTH

BURST_S: Final = 0.1
"""So long a stop breaks the silence."""
TAKES_S: Final = 1.0
"""A drive has so long to take a position."""
PAUSE_S: Final = 0.1
"""The handshake's bit is down for so long after a position that was not taken."""


class Oracle(Model):
    """Says what the leg does wrong."""

    __slots__ = ()

    def check(self, sent: tuple[int, ...], *, silent: bool) -> None:
        rules, word, now = self.rules, sent[0], self.now
        words = rules.words
        is_mute = self.mute_at is not None and now >= self.mute_at
        if is_mute:
            self._break_silence(word)
        assert silent is (is_mute and self.watches and self.speaks_until is None), (
            "nothing is sent where the site file says so, and only there; but a stop for everybody is, once"
        )
        assert word & words.valid == words.valid, "the drive takes what is sent"
        setpoints = sent[1:]
        enables = words.enabling.fit(word)
        if enables and not self.sends:
            is_braking = self.is_starting and self.is_heard and self.says == "braking"
            assert not is_braking, "a start waits for the end of a quick stop"
            self.followed = self.says == "enabled" and self.is_heard
        self.sends = enables
        if self.is_starting and self.is_heard and self.missing is Missing.NOTHING:
            assert not (enables and self.says == "inhibited"), "a drive is made ready before it is enabled"
        assert not (enables and self.is_braking), "a start waits for the end of a quick stop"
        if enables:
            self._check_enabling(word, setpoints)
        else:
            must = self.missing is Missing.NOTHING and (not self.is_starting or self.is_plain)
            assert not must and not self.is_held, "what may be enabled is enabled"
        assert not (self.is_plain and self.says == "enabled" and self.missing is Missing.NOTHING), (
            "a start ends when the drive is enabled"
        )
        if self.is_tripped and rules.reaction != "hold":
            assert self._are_at_rest(setpoints), "setpoints go to zero, or to where the drive is"
            self._check_reaction(word, is_mute=is_mute)
        if words.handshake:
            self._check_handshake(bool(word & words.handshake) and enables)

    def _break_silence(self, word: int) -> None:
        """For a stop that somebody asks for, where the drive has not been sent it in this silence: else who
        asks again and again would keep the drive's own supervision from tripping."""
        is_over = self.speaks_until is None or self.now >= self.speaks_until
        if self.asks and (word != self.said or (is_over and not self.watches)):
            self.speaks_until = self.now + BURST_S
        elif is_over:
            self.speaks_until = None
        if self.speaks_until is not None:
            self.said = word

    def _are_at_rest(self, setpoints: tuple[int, ...]) -> bool:
        return setpoints == self.at if self.at else not any(setpoints)

    def _check_enabling(self, word: int, setpoints: tuple[int, ...]) -> None:
        rules, words = self.rules, self.rules.words
        assert self.may_enable, "nothing enables a drive whose node is not there"
        if self.timeout_s and not rules.ignores and rules.reaction != "hold":
            assert self.deadline is not None, "nothing enables without a telegram of the owner"
            assert self.now < self.deadline, "nothing enables after the deadline"
        allowed = self.is_held or self.missing is Missing.NOTHING
        assert allowed, f"still missing: {self.missing.name}"
        is_commanded = self.says == "enabled" and self.is_heard
        if words.place and not (is_commanded or self.is_held):
            assert self._are_at_rest(setpoints), "enabling moves nothing"
        if not (words.place or self.has_set or self.is_held):
            assert self._are_at_rest(setpoints), "nobody's setpoints outlast a stop by somebody else"
        if words.begin:
            assert bool(word & words.begin) is self.has_begun, "it begins when the drive is enabled"

    def _check_reaction(self, word: int, *, is_mute: bool) -> None:
        """Tripped: the drive is stopped as the site file says, or more strongly, unless it stands."""
        words = self.rules.words
        assert not words.enabling.fit(word)
        if self.coasts_at is not None and self.now >= self.coasts_at:
            assert words.disable_voltage.fit(word), "a quick stop ends with disable voltage"
        elif is_mute and not self.watches:
            assert words.disable_voltage.fit(word), "where silence is no stop it is disable voltage"
        elif self.stop_kind and self.says in MOVING:
            self.check_stop(word, self.stop_kind)

    def check_stop(self, word: int, kind: str) -> None:
        assert any(stop.fit(word) for stop in self.rules.words.stops(kind)), f"{word:04X}h is no {kind}"

    def check_told(
        self,
        action: str,
        values: Mapping[str, Any],
        sent: tuple[int, ...],
        *,
        is_edge: bool,
        silent: bool,
        forwarded: bool,
    ) -> None:
        """*Forwarded* if and only if the wire says what was asked. ``values`` are those of a write;
        ``is_edge``: of two acknowledges by the same register the second is none."""
        if action == "write" and not values.keys() - {"life_sign"}:
            # A sign of life asks nothing of the drive.
            return
        words, word = self.rules.words, sent[0]
        says = not silent and not self.is_unsent
        if action == "write":
            says = says and self._carries(values, sent)
            wanted = values.get("control_word", words.enable)
            if self.is_tripped and (self.rules.reaction != "hold" or words.enabling.fit(wanted)):
                # What is taken then is kept from the drive, even where that gets the same by itself.
                assert not forwarded, "told as forwarded while tripped"
                return
        elif action in STRENGTH:
            says = says and any(stop.fit(word) for stop in words.stops(action))
        elif action == "reset_fault":
            assert silent or not is_edge or word & words.acknowledge, "an acknowledge goes to the drive"
            says = says and is_edge and bool(word & words.acknowledge)
        else:
            # Nothing is asked of the drive.
            return
        assert forwarded is says, f"{action} told as {'' if forwarded else 'not '}forwarded"

    def _carries(self, values: Mapping[str, Any], sent: tuple[int, ...]) -> bool:
        """The telegram is what is sent. The acknowledge bit counts as an edge alone; the bridge hands
        positions over."""
        words, wanted = self.rules.words, values.get("control_word")
        if wanted is not None:
            if (wanted ^ sent[0]) & ~(words.acknowledge | words.handshake):
                return False
            if not words.enabling.fit(wanted):
                return True
        others = {"control_word", "life_sign"}
        number = next((value for name, value in values.items() if name not in others), None)
        if number is None:
            return True
        size = 2 if "position" in values else 1
        return tuple(number >> 16 * place & 0xFFFF for place in range(size)) == sent[1 : 1 + size]

    def check_kernel(self, until: float | None, then: tuple[int, ...], *, silent: bool) -> None:
        """Check that enabling frames are on the bus until ``until``, whoever is alive then, and then
        ``then``."""
        rules = self.rules
        ends = [self.lease_until] if self.lease_until is not None else []
        if (
            self.deadline is not None
            and not rules.ignores
            and not self.is_tripped
            and rules.reaction != "hold"
        ):
            ends.append(self.deadline)
        assert until == min(ends, default=None), "the kernel keeps the bound"
        if until is None:
            return
        assert not rules.words.enabling.fit(then[0]), "and sends a stop then"
        assert self._are_at_rest(then[1:])
        if until == self.deadline and rules.reaction in STRENGTH:
            self.check_stop(then[0], rules.reaction)
        assert silent is (until == self.deadline and rules.mutes_after_s == 0 and self.watches)

    def _check_handshake(self, is_up: bool) -> None:
        now, taken = self.now, self.is_acknowledged
        commanded = self.sends and self.says == "enabled" and self.is_heard
        if not self.may_enable:
            self._forget()
        if self.down_until is not None and now >= self.down_until:
            self.down_until = None
        if self.was_commanded and not commanded:
            self._forget()
        self.was_commanded = commanded
        if self.is_up and taken:
            self.is_up, self.up_until = False, None
        elif self.is_up and self.up_until is not None and now >= self.up_until:
            self.is_up, self.up_until, self.handed = False, None, None
            self.down_until = now + PAUSE_S
        elif commanded and not (self.is_up or taken or self.down_until) and self.ordered is not None:
            self.is_up, self.up_until = True, now + TAKES_S
            self.ordered, self.handed = None, self.ordered
        should = self.was_up if self.is_held else self.is_up
        assert is_up is should, "a position is handed over once, and only when it may be"
        self.was_up = is_up
