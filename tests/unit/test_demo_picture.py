"""The picture of the README: drawn from what was measured, and promising what the program promises."""

from __future__ import annotations

import re
from itertools import pairwise
from xml.etree import ElementTree

from bridge.lint import lint
from bridge.project import load_project
from tests.support.process import REPOSITORY
from tools.demo_picture import PICTURE, Run, Sample, draw

TEXT = "{http://www.w3.org/2000/svg}text"
LINE = "{http://www.w3.org/2000/svg}polyline"
SENTENCE = re.compile(r"stopped after (\d+) ms; promised: (\d+) ms at most")


def numbers(svg: str) -> tuple[int, int]:
    [found] = filter(
        None, (SENTENCE.fullmatch(text.text or "") for text in ElementTree.fromstring(svg).iter(TEXT))
    )
    return int(found[1]), int(found[2])


def test_a_run_is_drawn_as_it_was() -> None:
    samples = [
        Sample(-0.5, 0x0B31, 0.0, 2, 2),
        Sample(0.5, 0x0B37, 12.5, 4, 2),
        Sample(1.0, 0x0B37, 25.0, 4, 2),
        Sample(2.25, 0x0B28, 0.0, 7, 3),
        Sample(3.0, 0x0B28, 0.0, 7, 3),
    ]
    svg = draw(Run([-0.5, 0.0, 1.25], samples, 1083))
    assert numbers(svg) == (1000, 1083)
    texts = [text.text for text in ElementTree.fromstring(svg).iter(TEXT)]
    assert "0B37h operation enabled" in texts
    assert texts.index("0B37h operation enabled") < texts.index("0B28h fault")
    [line] = ElementTree.fromstring(svg).iter(LINE)
    points = [tuple(map(float, point.split(","))) for point in line.attrib["points"].split()]
    assert all(before[0] < after[0] for before, after in pairwise(points)), "time goes on"
    assert len({y for _, y in points}) == 3, "0, 12.5 and 25 Hz"


def test_the_picture_of_the_readme_keeps_the_promise_of_today() -> None:
    project = load_project(REPOSITORY / "bridge" / "demo" / "site.toml")
    verdict = lint(project.site, project.families, project.path, project.downloads)
    [promised] = [case.stop.ms for case in verdict.worst_cases if case.drive == "conveyor/fu1"]
    measured, shown = numbers(PICTURE.read_text(encoding="utf-8"))
    assert shown == promised, "draw it anew: python -m tools.demo_picture"
    assert measured <= shown
