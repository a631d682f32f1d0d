"""Process data of a drive's TPDOs in the image: raw words, the values made of them, and their quality."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

from bridge.command.drive_channel import DriveChannel
from bridge.command.drive_link import FurtherTpdo
from bridge.command.meaning_news import MeaningNews
from bridge.command.stop_check.drive_check import DriveStopCheck
from bridge.drive import DriveState, Lack, ParameterSet, ValueCodec, codecs
from bridge.image import Image, Quality, Value
from bridge.mapping.model import Meaning, Slot
from bridge.text import Said, Text

_GOOD: Final = (Quality.GOOD, "")
_SPEEDS: Final = ("frequency", "velocity")
"""Names of the actual value that shows whether a drive slows down."""
_STATUS: Final = ("status_word", "drive_status_word", "state", "emcy_code")


class _Plain(NamedTuple):
    """One signed word times a factor: value = word × full / at."""

    place: int
    full: float
    at: float


@dataclass(frozen=True, slots=True)
class _Judged:
    """Point of the process data: its lack, None where it is served, and the further TPDOs that bring it."""

    index: int
    lack: Lack | None = None
    further: tuple[FurtherTpdo, ...] = ()


@dataclass(frozen=True, slots=True)
class _Compiled:
    """Decoding of the words in one parameter set; plain values, computed without a call, come first."""

    plain: tuple[_Plain, ...]
    others: tuple[ValueCodec, ...]
    judged: tuple[_Judged, ...]
    speed: ValueCodec | None
    """Codec of the actual speed; None where the TPDO with the status word brings none."""


class ActualData:
    """The process data of one drive. A PDO costs one comparison per value."""

    def __init__(
        self,
        channel: DriveChannel,
        slot: Slot,
        stop_check: DriveStopCheck,
        image: Image,
        news: MeaningNews,
    ) -> None:
        """Process data of one drive. ``news`` gets the codes of words' meanings that a TPDO tells."""
        drive, family = channel.name, channel.family
        self._news = news
        told = [(one, family.told_by(slot, one)) for one in _meanings(channel, slot)]
        self._can_tell = [(family.process.tpdo.index(word), one) for one, word in told if word]
        self._telling: list[tuple[int, Meaning]] = []
        self._codes_told: list[int] = []
        self._image = image
        self._channel = channel
        self._stop_check = stop_check
        self._has_followers = any(value.follows for value in family.values_of(slot))
        self._process = family.process.tpdo
        self._set = ParameterSet(family.status_word.parameter_set_bits)
        self.words: list[int] = [0] * len(self._process)
        """The words of the last TPDOs, the status word first."""
        self.quality = Quality.WAITING
        self._carried = family.carried(slot)[1][1:]
        self._places = [self._process.index(word) for word in self._carried]
        self._has_all = len(self._carried) == len(self._process) - 1
        # Those that most drives have go first: they are computed without a call.
        found = codecs(family, slot, "actual", self._process, {})
        self._codecs = sorted(found, key=lambda codec: not codec.is_plain)
        self._of_sets: dict[int, _Compiled] = {}
        self._status = [image.index[f"{drive}/status/{leaf}"] for leaf in _STATUS]
        leaves = [f"actual/{word}" for word in self._carried]
        leaves += [codec.model.leaf for codec in self._codecs]
        self._indices = [image.index[f"{drive}/{leaf}"] for leaf in leaves]
        self._shown: tuple[Quality, Said] | None = None
        """Quality and reason as the image has them for the process data."""
        self.compile()

    def compile(self) -> None:
        """Take over what the boot-up has found, or what has been read since."""
        unserved = self._channel.unserved
        self._telling = [
            (place, one) for place, one in self._can_tell if f"actual/{self._process[place]}" not in unserved
        ]
        self._of_sets.clear()
        self._use(self.words[0])

    @property
    def told_by_tpdo(self) -> frozenset[str]:
        """Leaves of the words whose meaning the drive's TPDOs tell."""
        return frozenset(one.leaf for _, one in self._telling)

    def _look_for_codes(self, now: float) -> None:
        told = [self.words[place] for place, _ in self._telling]
        if told == self._codes_told:
            return
        self._codes_told = told
        for (_, meaning), word in zip(tuple(self._telling), told, strict=True):
            self._news.on_told(meaning, word - 0x1_0000 if word & 0x8000 else word, now)

    def _compiled(self, in_set: int) -> _Compiled:
        found = [self._channel.meanings.codec(codec, in_set) for codec in self._codecs]
        return _Compiled(
            tuple(_plain(codec) for codec, _ in found if codec.is_plain),
            tuple(codec for codec, _ in found if not codec.is_plain),
            tuple(self._to_judge(self._channel.unserved, found, in_set)),
            next((codec for codec, lack in found if self._is_speed(codec, lack)), None),
        )

    def _is_speed(self, codec: ValueCodec, lack: Lack | None) -> bool:
        """An actual speed that the TPDO with the status word brings; its scale may be unknown."""
        unserved = [
            f"actual/{leaf}" for leaf in (codec.model.name, *(self._process[n] for n in codec.places))
        ]
        is_served = codec.places and not any(leaf in self._channel.unserved for leaf in unserved)
        is_known = lack is None or codec.is_unknown
        return bool(codec.model.name in _SPEEDS and is_served and is_known) and not self._further_of(
            codec.places
        )

    def _use(self, status_word: int) -> None:
        """Use the meanings of the parameter set that the status word tells, compiled when it does so for the
        first time."""
        in_set = self._set.of(status_word)
        compiled = self._of_sets.get(in_set)
        if compiled is None:
            compiled = self._of_sets[in_set] = self._compiled(in_set)
        self._plain, self._others, self._judged = compiled.plain, compiled.others, compiled.judged
        self._speed = compiled.speed
        self._shown = None

    def _to_judge(
        self, unserved: Mapping[str, Text], found: Iterable[tuple[ValueCodec, Lack | None]], in_set: int
    ) -> Iterable[_Judged]:
        for index in self._status:
            yield _Judged(index)
        rest = iter(self._indices)
        for word, place in zip(self._carried, self._places, strict=True):
            yield _Judged(next(rest), _unserved(unserved, [word]), self._further_of((place,)))
        for codec, lack in found:
            leaves = [codec.model.name, *(self._process[place] for place in codec.places)]
            why = self._channel.meanings.doubt(codec.model, in_set)
            doubt = Lack(Quality.STALE, why) if why else None
            index, lack = next(rest), _unserved(unserved, leaves) or lack or doubt
            yield _Judged(index, lack, self._further_of(codec.places))

    def _further_of(self, places: Sequence[int]) -> tuple[FurtherTpdo, ...]:
        return tuple(pdo for pdo in self._channel.link.further if not pdo.places.isdisjoint(places))

    def on_heard_again(self) -> None:
        """Call the further TPDOs stale: their values may have changed while the drive was not heard."""
        for pdo in self._channel.link.further:
            if pdo.quality is Quality.GOOD:
                pdo.quality = Quality.STALE
        self._shown = None

    def on_further_data(self, pdo: FurtherTpdo, now: float) -> None:
        """Take over a further TPDO, whose words are in ``words`` already."""
        if self._has_followers:
            self._channel.on_actual_words(self.words, now)
        if pdo.on_data(now):
            self._shown = None
        if self._telling:
            self._look_for_codes(now)
        self.refresh(now)

    def look(self, now: float) -> None:
        """Judge the quality of all points; a deadline that has passed otherwise shows when a timer runs."""
        if [pdo for pdo in self._channel.link.further if pdo.on_time(now)]:
            self._shown = None
        if not self._is_good(now):
            self.refresh(now)

    def on_process_data(self, words: Sequence[int], now: float) -> None:
        """Take over a changed TPDO with the status word; ``words`` are raw, ordered as ``process.tpdo``."""
        held, channel = self.words, self._channel
        if self._has_followers:
            channel.on_actual_words(words, now)
        self._stop_check.before_pdo(now)
        has_new_status = words[0] != held[0]
        if (words[0] ^ held[0]) & self._set.mask:
            self._use(words[0])
        held[:] = words
        channel.on_pdo(now)
        channel.on_status_word(words[0], now)
        if self._telling:
            self._look_for_codes(now)
        if has_new_status or not self._is_good(now):
            self.refresh(now)
        else:
            self._refresh_values(now)
        self._judge_stop(now)

    def on_unchanged_data(self, now: float) -> None:
        """Take note of a TPDO with the same data as the last one."""
        self._stop_check.before_pdo(now)
        self._channel.on_unchanged(now)
        self._judge_stop(now)
        if self.quality is not Quality.GOOD:
            self.refresh(now)

    def _judge_stop(self, now: float) -> None:
        """Tell the stop check of the TPDO that has just arrived."""
        self._stop_check.after_pdo(now)
        if self._channel.leg.drive is DriveState.OPERATION_ENABLED:
            speed = None if self._speed is None else float(self._speed.from_words(self.words))
            self._stop_check.on_telegram(now, speed)

    def refresh(self, now: float) -> None:
        channel = self._channel
        if not self._is_good(now):
            self._judge(channel.link.quality(now), now)
        status = (
            channel.status_word,
            channel.drive_status_word,
            int(channel.served_state),
            channel.emcy_code,
        )
        self._image.set_values(self._status, status, now)
        if self.quality.has_value:
            self._refresh_values(now)

    def _is_good(self, now: float) -> bool:
        """The process data are good, and the image says so."""
        return self._shown is _GOOD and self._channel.link.quality(now) is Quality.GOOD

    def _refresh_values(self, now: float) -> None:
        """Show the words beside the status word, raw and as values."""
        words = self.words
        values: list[Value] = [*words[1:]] if self._has_all else [words[place] for place in self._places]
        for place, full, at in self._plain:
            word = words[place]
            values.append((word - 0x1_0000 if word & 0x8000 else word) * full / at)
        if self._others:
            values.extend([codec.from_words(words) for codec in self._others])
        self._image.set_values(self._indices, values, now)

    def _judge(self, quality: Quality, now: float) -> None:
        """Show another quality, or another reason for a bad one."""
        self.quality = quality
        reason = self._channel.link.reason(quality)
        if (quality, reason) == self._shown:
            return
        self._shown = _GOOD if quality is Quality.GOOD else (quality, reason)
        for point in self._judged:
            own, why = self._quality_of(point, quality)
            self._image.judge((point.index,), own, now, why or reason)

    def _quality_of(self, point: _Judged, quality: Quality) -> tuple[Quality, Said]:
        """Quality of a point, and the reason where that is not the one of the drive's ``quality``."""
        if not quality.has_value:
            return quality, ""
        if point.lack and not point.lack.quality.has_value:
            return point.lack
        for pdo in sorted(point.further, key=_goodness):
            # Waiting goes first, then stale.
            is_worse = quality is Quality.GOOD or pdo.quality is Quality.WAITING
            if pdo.quality is not Quality.GOOD and is_worse:
                return pdo.quality, Text.of("quality.no_pdo", pdo=pdo.name)
        return point.lack if point.lack and quality is Quality.GOOD else (quality, "")


def _meanings(channel: DriveChannel, slot: Slot) -> list[Meaning]:
    return [
        one
        for group in ("command", "actual")
        for run in channel.family.meanings_of(slot, group)
        for one in run
    ]


def _plain(codec: ValueCodec) -> _Plain:
    """Factor of a plain codec: 1 where its scale is unknown, 0 where it has no word."""
    if not codec.places:
        return _Plain(0, 0, 1)
    scale = codec.scale
    return _Plain(codec.places[0], scale.full, scale.at) if scale else _Plain(codec.places[0], 1, 1)


def _unserved(unserved: Mapping[str, Text], leaves: Iterable[str]) -> Lack | None:
    """Lack of these actual values, of which the node's PDOs do not carry one; None where they carry all."""
    for leaf in leaves:
        why = unserved.get(f"actual/{leaf}")
        if why:
            return Lack(Quality.CONFIG_ERROR, why)
    return None


def _goodness(pdo: FurtherTpdo) -> int:
    return (Quality.WAITING, Quality.STALE, Quality.GOOD).index(pdo.quality)
