"""The notebook of the docs runs beside a bridge, on the site of its page, and says what is stored in it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.support.docs import page
from tests.support.process import REPOSITORY, drivebridge, peer_called

NOTEBOOK = REPOSITORY / "docs" / "how-to" / "compare-drives.ipynb"
BARS = "print(len(plt.gca().patches), plt.gca().get_ylabel())"


def stored(cell: dict[str, Any]) -> dict[str, str | None]:
    """What a code cell has written, and the text of its result; pictures are left out."""
    told: dict[str, str | None] = {"written": "", "result": None}
    for output in cell["outputs"]:
        if output["output_type"] == "stream":
            told["written"] = "".join(output["text"])
        elif output["output_type"] == "execute_result":
            told["result"] = "".join(output["data"]["text/plain"])
    return told


@pytest.mark.landing
def test_the_notebook_runs_and_says_what_it_shows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (site,) = [block for block in page("how-to/compare-drives-in-a-notebook.md").blocks if block.file_name]
    (tmp_path / "hall.toml").write_text(site.text, encoding="utf-8")
    cells = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]
    expected = [stored(cell) for cell in cells if cell["cell_type"] == "code"]
    monkeypatch.setenv("MPLBACKEND", "Agg")
    with drivebridge(tmp_path, "hall", "run", "hall.toml", notify=True) as process:
        process.wait_ready()
        for node in ("infeed", "outfeed"):
            process.wait_output(f"{node}: node operational")
        done = peer_called("notebook", str(NOTEBOOK), str(tmp_path), BARS)
    assert done.returncode == 0, done.stderr
    *told, bars = (json.loads(line) for line in done.stdout.splitlines())
    assert told == expected
    assert bars["written"] == "8 P102 in s\n"
