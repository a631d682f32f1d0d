"""The stages of a boot-up on the page: each of its steps belongs to one."""

from __future__ import annotations

import re
from pathlib import Path

from bridge.text.templates import templates

NODES = Path("bridge/northbound/page/static/js/bus/nodes.js")


def stages() -> dict[str, list[str]]:
    """The steps of each stage."""
    script = NODES.read_text(encoding="utf-8")
    table = script[script.index("const STEPS") : script.index("};", script.index("const STEPS"))]
    return {stage: re.findall(r'"(\w+)"', steps) for stage, steps in re.findall(r"(\w+): \[(.+)\]", table)}


def test_each_step_of_a_boot_up_belongs_to_one_stage() -> None:
    steps = [code.partition(".")[2] for code in templates("en") if code.startswith("boot_step.")]
    assert sorted(step for of_stage in stages().values() for step in of_stage) == sorted(
        step for step in steps if step != "needed"
    )


def test_the_stages_come_in_their_order() -> None:
    script = NODES.read_text(encoding="utf-8")
    listed = re.search(r"const STAGES = \[(.+)\];", script)
    assert listed and re.findall(r'"(\w+)"', listed[1]) == list(stages())
