"""Troubles in words, in the language of a reader: what is wrong, why, and what to do. Sans-IO.

A trouble is what the points tell, as ``condition.told`` has it. The page has the same sentences, which
``tools.page_texts`` makes of ``bridge.text``, and knows of its own tabs, too.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

from bridge.condition.plant_layout import MOVES_BY
from bridge.text import Text, Words, from_json, render
from bridge.text.templates import templates

KINDS: Final = (
    "box_slow",
    "bridge_dead",
    "bus_down",
    "bus_errors",
    "bus_off",
    "bus_silent",
    "controller_silent",
    "controllers_silent",
    "drive_fault",
    "drive_lost",
    "drive_not_as_configured",
    "drive_stale",
    "duplicate_ids",
    "fronts_failing",
    "held",
    "ignores_stop",
    "intruder",
    "log_lost",
    "no_actual",
    "no_command",
    "node_absent",
    "node_booting",
    "node_disabled",
    "node_lost",
    "node_stopped",
    "not_as_configured",
    "outputs_ignore_stop",
    "second_master",
    "stop_unproven",
    "unexpected_nodes",
)
"""Kinds of troubles. Of each there is a headline, a reason and a remedy."""
CONDITION_WORDS: Final = (
    *(f"{kind}{part}" for kind in KINDS for part in ("", ".why", ".remedy")),
    *(f"controller_silent.why_{case}" for case in ("hold", "hold_over", "silence")),
    "drive_fault.why_and_cause",
    "left.remedy",
)
"""Words of the group ``condition`` of texts."""
_REASONS: Final = ("why", "how", "who", "fronts")
"""Facts that may be empty where the reason is not known."""

FaultIn = Callable[[str, str, str], Mapping[str, str]]
"""(drive, number of a fault, language): text, cause and remedy in this language; empty where they stay as the
points have them."""


def _as_it_is(drive: str, number: str, language: str) -> Mapping[str, str]:
    return {}


@dataclass(frozen=True, slots=True)
class PlantWords:
    """Facts of a plant for the words of its troubles. ``on_expiry`` is the reaction to a silent controller by
    drive."""

    fault_in: FaultIn = _as_it_is
    on_expiry: Mapping[str, str] = field(default_factory=dict[str, str])


@dataclass(frozen=True, slots=True)
class TroubleWords:
    """Sentences on one trouble; ``cause`` is the maker's for a fault of a drive, else the reason."""

    headline: str
    why: str
    cause: str
    remedy: str

    @property
    def message(self) -> str:
        return f"{_capital(self.headline)}. {_capital(self.why)}".rstrip(" ")


def trouble_words(trouble: Mapping[str, Any], plant: PlantWords, language: str) -> TroubleWords:
    kind, facts = str(trouble["kind"]), _facts(trouble, plant, language)
    said = _Sentences(kind, facts, language)
    why = said(f"why{_variant(kind, trouble, plant)}")
    if trouble.get("until"):
        remedy = render(_text("left.remedy", {}), language)
    else:
        remedy = str(facts.get("remedy") or said("remedy"))
    return TroubleWords(said(""), why, str(facts.get("cause") or why), remedy)


@dataclass(frozen=True, slots=True)
class _Sentences:
    kind: str
    facts: Mapping[str, Any]
    language: str

    def __call__(self, part: str) -> str:
        name = f"{self.kind}.{part}".rstrip(".")
        # The bus process may be of another version for a moment, and tell what is not known here.
        if Text.word("condition", name).code not in templates(self.language):
            return self.kind.replace("_", " ") if not part else ""
        return render(_text(name, self.facts), self.language)


def _text(name: str, facts: Mapping[str, Any]) -> Text:
    code = Text.word("condition", name)
    wanted = {part.name for part in templates("en")[code.code] if part.name}
    return replace(code, facts=tuple((one, facts.get(one, "")) for one in sorted(wanted)))


def _variant(kind: str, trouble: Mapping[str, Any], plant: PlantWords) -> str:
    """Addition for a watchdog that does not stop the drive itself."""
    if kind != "controller_silent":
        return ""
    match plant.on_expiry.get(trouble["place"]):
        case "hold":
            return "_hold" if trouble["facts"].get("owner") else "_hold_over"
        case "silence":
            return "_silence"
        case _:
            return ""


def _facts(trouble: Mapping[str, Any], plant: PlantWords, language: str) -> dict[str, Any]:
    """Facts in this language."""
    facts = dict(trouble["facts"])
    texts = {name: from_json(told) for name, told in trouble.get("texts", {}).items()}
    for name, said in texts.items():
        facts[name] = _rendered(_without_number(said), language)
    if "number" in facts:
        facts |= plant.fault_in(trouble["place"], str(facts["number"]), language)
        facts["text"] = _capital(str(facts.get("text", "")))
    for name in _REASONS:
        if name in facts and not facts[name]:
            facts[name] = render(Text.of("reason.unknown"), language)
    if facts.get("owner") == "":
        facts["owner"] = render(Text.of("owner.gone"), language)
    if "value" in facts:
        facts["value"] = _quantity(str(facts["value"]), language)
    return facts


def _without_number(said: Text) -> Words:
    """The headline has the number already."""
    facts = dict(said.facts)
    text = facts.get("text")
    return text if said.code == "fault.numbered" and isinstance(text, Text | str) else said


def _rendered(said: Words, language: str) -> str:
    if isinstance(said, Text) and said.code not in templates(language):
        return said.code
    return render(said, language)


def _quantity(leaf: str, language: str) -> str:
    if leaf not in MOVES_BY:
        return leaf.replace("_", " ")
    return render(Text.word("quantity", leaf), language)


def _capital(words: str) -> str:
    return words[:1].upper() + words[1:]
