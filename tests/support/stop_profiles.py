"""Profiles of events for the judge of a drive's stops, so that all of them can be explored together."""

from __future__ import annotations

from typing import Final

_TICKS: Final = ("tick", "tick, asked when it is due")
_WORDS: Final = ("sends ENABLES", "sends OFF", "sends RAMP", "handed over")
_REPORTS: Final = ("says ENABLED", "says STOPPING", "says HOLDING", "says AT_REST")
_NODE: Final = ("node operational", "node gone")

PROFILES: Final[dict[str, tuple[str, ...]]] = {
    "words and reports": ("node operational", *_WORDS, *_REPORTS, "tick"),
    "asked when it is due": (
        *("node operational", "sends ENABLES", "sends OFF", "handed over", *_REPORTS),
        *(*_TICKS, "tick without a telegram"),
    ),
    "silence and pauses": (
        *("node operational", "sends ENABLES", "sends SILENT", "sends OFF", "handed over"),
        *("says ENABLED", "says NOTHING", "says AT_REST", "heard after a pause"),
        *(*_TICKS, "tick without a telegram"),
    ),
    "ramps and pauses": (
        *("node operational", "sends OFF", "sends RAMP", "handed over", "says ENABLED", "says STOPPING"),
        *("heard after a pause", *_TICKS, "tick without a telegram"),
    ),
    "nodes that leave": (
        *(*_NODE, "cut off", "node stopped", "node restarted", "sends ENABLES", "sends OFF", "sends RAMP"),
        *("handed over", "says ENABLED", "says AT_REST", "tick, asked when it is due"),
    ),
    "nodes that leave on a ramp": (
        *(*_NODE, "cut off", "node stopped", "sends ENABLES", "sends OFF", "sends SILENT", "handed over"),
        *("says STOPPING", "says HOLDING", "tick"),
    ),
}
ON_CHANGE: Final[dict[str, tuple[str, ...]]] = {
    "words and reports, on change": (
        *("node operational", "sends ENABLES", "sends OFF", "sends RAMP", "handed over"),
        *("says ENABLED", "says STOPPING", "says AT_REST", "tick without a telegram"),
    ),
    "nodes that leave, on change": (
        *(*_NODE, "cut off", "node stopped", "node restarted", "sends ENABLES", "sends OFF"),
        *("handed over", "says ENABLED", "says AT_REST", "tick without a telegram"),
    ),
}
