"""Texts for people: a code with facts, and its words in each language."""

from bridge.text.templates import LANGUAGES
from bridge.text.text import Fact, Said, Text, Words, as_json, from_json, in_english, render

__all__ = ["LANGUAGES", "Fact", "Said", "Text", "Words", "as_json", "from_json", "in_english", "render"]
