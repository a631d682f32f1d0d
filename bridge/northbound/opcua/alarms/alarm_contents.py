"""Contents of alarms: a trouble as fields of an event, in all languages."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from datetime import datetime
from typing import Any, Final

import msgspec

from bridge.image import Image
from bridge.northbound.opcua.alarms.alarm_places import AlarmPlace
from bridge.northbound.trouble_words import PlantWords, TroubleWords, trouble_words
from bridge.text import LANGUAGES, Text, render
from bridge.uaserver.conditions.condition_fields import AlarmContent
from bridge.uaserver.filters.where import own_name
from bridge.uaserver.languages import Spoken
from bridge.uaserver.library import ua, variant

Kind = ua.VariantType

SEVERITY: Final = {"danger": 1000, "alarm": 800, "warning": 400}
"""Severity by the rank of a trouble."""
_WARNING: Final = SEVERITY["warning"]
_encode = msgspec.json.Encoder().encode


class AlarmContents:
    """Makes contents; their own fields are in ``namespace``. ``image`` has what the troubles do not tell."""

    def __init__(self, image: Image, plant: PlantWords, namespace: int) -> None:
        self._image = image
        self._plant = plant
        self._namespace = namespace
        self.nothing = self._content(lambda language: TroubleWords("", "", "", ""), 1, {})
        """Content of an alarm that never was active."""

    def of(self, trouble: Mapping[str, Any], place: AlarmPlace) -> AlarmContent:
        """Raises KeyError and TypeError for what is no trouble."""
        facts: dict[str, Any] = trouble["facts"]
        own = {
            "Code": str(Text.word("condition", trouble["kind"]).code),
            "Facts": _encode(facts).decode(),
            "Explains": [one["place"] for one in trouble.get("explains", ())],
            "Owner": str(facts.get("owner", "")),
            "FaultNumber": str(facts.get("number", "")),
            "EmergencyCode": self._emergency_code(place),
        }
        return self._content(
            lambda language: trouble_words(trouble, self._plant, language), SEVERITY[trouble["rank"]], own
        )

    def over(self, content: AlarmContent) -> AlarmContent:
        """The same, once it is over."""
        said = {
            language: render(Text.of("alarm.over", what=words), language)
            for language, words in _words_of(content.message).items()
        }
        return replace(content, message=Spoken(said))

    def expiry(self, date: datetime) -> AlarmContent:
        """The server's own certificate runs out on ``date``."""
        day = f"{date:%Y-%m-%d}"
        said = Text.of("certificate.expires", day=day), Text.of("certificate.expires_remedy")
        own = {"Code": said[0].code, "Facts": _encode({"day": day}).decode()}

        def words(language: str) -> TroubleWords:
            why, remedy = (render(one, language) for one in said)
            return TroubleWords(why, "", why, remedy)

        return self._content(words, _WARNING, own)

    def _content(
        self, words: Callable[[str], TroubleWords], severity: int, own: Mapping[str, Any]
    ) -> AlarmContent:
        said = {language: words(language) for language in LANGUAGES}
        fields = {
            "Cause": variant(_spoken(said, "cause"), Kind.LocalizedText),
            "Remedy": variant(_spoken(said, "remedy"), Kind.LocalizedText),
            "Explains": variant(own.get("Explains", []), Kind.String, is_array=True),
            "EmergencyCode": variant(own.get("EmergencyCode", 0), Kind.UInt16),
            **{name: variant(own.get(name, ""), Kind.String) for name in _STRINGS},
        }
        more = {own_name(name, self._namespace): value for name, value in fields.items()}
        return AlarmContent(_spoken(said, "message"), severity, more)

    def _emergency_code(self, place: AlarmPlace) -> int:
        """Emergency code that the drive sent last; 0 where there is none."""
        index = self._image.index.get(f"{place.owner}/status/emcy_code")
        value = None if index is None else self._image[index].value
        return value if isinstance(value, int) else 0


_STRINGS: Final = ("Code", "Facts", "Owner", "FaultNumber")


def _spoken(said: Mapping[str, TroubleWords], what: str) -> Spoken:
    return Spoken({language: getattr(words, what) for language, words in said.items()})


def _words_of(message: ua.LocalizedText) -> Mapping[str, str]:
    return message.words if isinstance(message, Spoken) else {"en": message.Text or ""}
