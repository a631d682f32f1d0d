"""The stages of a boot-up on the page: the words of each of its steps belong to one."""

from __future__ import annotations

import ast
import re
from pathlib import Path

NODES = Path("bridge/northbound/page/static/js/bus/nodes.js")
STAGES = {
    "looking for the node": "found",
    "reading where it listens": "found",
    "reading the identity": "identity",
    "reading name and version": "identity",
    "reading its errors": "identity",
    "resetting its communication": "configuration",
    "comparing the configuration": "configuration",
    "downloading the configuration, … of …": "configuration",
    "storing the configuration": "configuration",
    "reading the identifier of emergency messages": "configuration",
    "opening …": "configuration",
    "setting error control": "configuration",
    "setting and reading the process data mapping of …": "pdos",
    "reading the process data mapping": "pdos",
    "reading the drives' own supervision": "supervision",
    "reading the node's own supervision": "supervision",
    "reading what the words mean": "supervision",
    "waiting for …": "supervision",
    "starting": "start",
}
"""Of each step the stage, in the order of the procedure (bridge/node/boot/procedure.py)."""


def words() -> list[tuple[str, re.Pattern[str]]]:
    script = NODES.read_text(encoding="utf-8")
    table = script[script.index("const WORDS") : script.index("];", script.index("const WORDS"))]
    return [(stage, re.compile(found)) for stage, found in re.findall(r'\["(\w+)", /(.+)/\]', table)]


def steps() -> set[str]:
    """The text of each ``Step``, with … for what is filled in."""
    found: set[str] = set()
    for module in Path("bridge/node/boot").glob("*.py"):
        for call in ast.walk(ast.parse(module.read_text(encoding="utf-8"))):
            if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "Step":
                found.add(_text(call.args[0]))
    return found


def _text(text: ast.expr) -> str:
    parts = text.values if isinstance(text, ast.JoinedStr) else [text]
    return "".join(str(part.value) if isinstance(part, ast.Constant) else "…" for part in parts)


def test_each_step_of_a_boot_up_belongs_to_one_stage() -> None:
    assert steps() == STAGES.keys()
    for step, stage in STAGES.items():
        assert [name for name, pattern in words() if pattern.search(step)] == [stage], step


def test_the_stages_come_in_the_order_of_the_steps() -> None:
    assert list(dict.fromkeys(STAGES.values())) == [name for name, _ in words()]
