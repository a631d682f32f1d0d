"""The page's file of sentences that are not its own: on troubles, from ``bridge/text``.

The page needs them before it has asked for anything. ``python -m tools.page_texts`` makes the file anew.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Final

from bridge.text import LANGUAGES
from bridge.text.templates import source

FILE: Final = Path("bridge/northbound/page/static/js/texts/troubles.js")
_GROUP: Final = "condition."
_OTHERS: Final = {"owner.gone": "owner.gone", "reason.unknown": "unknown"}
"""Keys of the page by the codes of single texts."""
_HEAD: Final = (
    "// Sentences on troubles, made by tools/page_texts.py from bridge/text: they are changed there.\n"
)


def page_texts() -> str:
    """Content of ``FILE``."""
    return _HEAD + "".join(_object(language) for language in LANGUAGES)


def _object(language: str) -> str:
    lines = [
        f"  {json.dumps(key)}: {json.dumps(words, ensure_ascii=False)},\n"
        for code, words in json.loads(source(language)).items()
        if (key := _key(code))
    ]
    return f"\nexport const {language} = {{\n{''.join(lines)}}};\n"


def _key(code: str) -> str:
    """Key of the page; "" for a text that is not in its file."""
    return code.replace(_GROUP, "trouble.", 1) if code.startswith(_GROUP) else _OTHERS.get(code, "")


if __name__ == "__main__":
    sys.exit(FILE.write_text(page_texts(), encoding="utf-8") and None)
