"""Texts for people: a code with facts, and its words in each language."""

from bridge.text.templates import LANGUAGES
from bridge.text.text import Fact, Text, as_json, in_english, render

__all__ = ["LANGUAGES", "Fact", "Text", "as_json", "in_english", "render"]
