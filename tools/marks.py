"""What a program draws on a page stands between two marks."""

from __future__ import annotations


def replaced(text: str, begin: str, end: str, drawing: str) -> str:
    """``text`` of a page with ``drawing`` between its marks. Raises ValueError where the page has none."""
    before, has_begin, rest = text.partition(begin)
    _, has_end, after = rest.partition(end)
    if not has_begin or not has_end:
        raise ValueError(f"the page has no line {begin!r} with {end!r} after it")
    return f"{before}{begin}\n\n{drawing}\n\n{end}{after}"
