"""The page's file of sentences on troubles says what ``bridge/text`` says."""

from __future__ import annotations

from tools.page_texts import FILE, page_texts


def test_the_file_is_up_to_date() -> None:
    assert FILE.read_text(encoding="utf-8") == page_texts(), "python -m tools.page_texts"


def test_it_has_both_languages() -> None:
    made = page_texts()
    assert made.count('"trouble.bus_silent.remedy": ') == 2
    assert '"unknown": "nicht bekannt"' in made
