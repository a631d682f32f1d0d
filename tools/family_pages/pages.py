"""A page for each drive family, and their index."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from bridge.mapping import Family, family_names, load_family
from bridge.mapping.loader import lineage, mappings_dir
from bridge.sim.catalogue import SIMULATED
from tools.family_pages.faults import faults, own_supervision
from tools.family_pages.parameters import parameters, polls
from tools.family_pages.process import process, values
from tools.family_pages.text import table
from tools.family_pages.words import words

_MADE = "<!-- Made by tools/family_pages from the mapping file: `make docs` writes it anew. -->"


def pages() -> dict[str, str]:
    """Every page by its file name."""
    names = family_names((mappings_dir(),))
    families = {name: load_family(name, (mappings_dir(),)) for name in names}
    made = {f"{_slug(name)}.md": _text(_page(name, family)) for name, family in families.items()}
    return {**made, "index.md": _text(_index(families))}


def _text(lines: Iterable[str]) -> str:
    return "\n".join(lines) + "\n"


def _slug(name: str) -> str:
    return name.replace("/", "-")


def _title(family: Family) -> str:
    facts = family.family
    return facts.name if facts.vendor == "any" else f"{facts.vendor} {facts.name}"


def _index(families: dict[str, Family]) -> Iterator[str]:
    yield "# Drive families"
    yield ""
    yield _MADE
    yield ""
    yield "What the program knows of each is in its mapping file, and these pages are made from those files. \
Simulated: `drivebridge simulate` and the virtual bus can play it. Another one is \
[one file](../../how-to/add-a-drive-family.md)."
    yield ""
    yield from table(
        ("mapping", "device", "drives of a node", "manual", "simulated"),
        (
            (
                f"[`{name}`]({_slug(name)}.md)",
                _title(family),
                ", ".join(f"`{slot.name}`" for slot in family.slot),
                family.family.source,
                "yes" if name in SIMULATED else "",
            )
            for name, family in families.items()
        ),
    )


def _page(name: str, family: Family) -> Iterator[str]:
    facts = family.family
    chain = lineage(name, (mappings_dir(),))
    yield f"# {_title(family)}"
    yield ""
    yield _MADE
    yield ""
    files = ", which extends ".join(f"[`{one}`](../../../mappings/{one}.toml)" for one in chain)
    yield f'`mapping = "{name}"` in the site file. Mapping file: {files}. Source: {facts.source}. \
Addresses: {facts.node_id_low}…{facts.node_id_high}.'
    eds = [one for one in chain if (mappings_dir() / f"{one}.eds").is_file()]
    if eds:
        yield f"Object dictionary: [`{eds[0]}.eds`](../../../mappings/{eds[0]}.eds)."
    if name not in SIMULATED:
        yield "It cannot be simulated."
    yield ""
    notes = [line for one in chain for line in _notes(one)]
    if notes:
        yield "## What is special"
        yield ""
        yield from notes
    yield from _identity(family)
    yield from process(family)
    yield from values(family)
    yield from words(family)
    yield from parameters(family)
    yield from polls(family)
    yield from faults(family)
    yield from own_supervision(family)


def _notes(name: str) -> Iterator[str]:
    """The comments at the top of a mapping file, as paragraphs."""
    for line in (mappings_dir() / f"{name}.toml").read_text(encoding="utf-8").splitlines():
        if line and not line.startswith("#"):
            break
        if not line.startswith("#:"):
            yield line.removeprefix("#").removeprefix(" ")
    yield ""


def _identity(family: Family) -> Iterator[str]:
    shown = {key: value for key, value in family.identity.model_dump().items() if value is not None}
    yield "## Identity"
    yield ""
    if not shown:
        yield "Nothing that a node answers tells the family."
        yield ""
        return
    yield from table(
        ("key", "value"),
        (
            (f"`{key}`", f"`{value}`" if isinstance(value, str) else f"`{value:X}h`")
            for key, value in shown.items()
        ),
    )
