"""Write docs/reference/families/ anew. ``make docs`` runs it; a unit test fails where it was not run."""

from __future__ import annotations

from pathlib import Path

from tools.family_pages.pages import pages

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "reference" / "families"


def main() -> None:
    FOLDER.mkdir(exist_ok=True)
    made = pages()
    for path in FOLDER.glob("*.md"):
        if path.name not in made:
            path.unlink()
    for name, text in made.items():
        (FOLDER / name).write_text(text, encoding="utf-8")
    print(f"docs/reference/families: {len(made)} pages")


if __name__ == "__main__":
    main()
