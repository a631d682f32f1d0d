"""Plants of each seeded fault of the chain: which of the oracle's rules finds it, and how soon.

    python -m tests.plant.mutants [NAME ...] [--of PATH] [--seconds S] [--seed N] [--json FILE]

A mutant (of tests/proof/mutants.toml, of another such table, or of all that are in a folder, such as
tests/plant/taken_back) goes into a copy of the program, and plants of both halves of the drives
are played with it, ``--seconds`` of CPU in all, until something is wrong. Then the same plan is played with
the program as it is, in which nothing may be wrong. Ends with 1 where that finds something, or a mutant lives
that is not in ``ELSEWHERE``.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from tests.proof.mutants import TABLE, Mutant, Tree, load
from tests.support.process import REPOSITORY

ELSEWHERE: Final = {
    "bursts outlive a bus-off": "the fault is in what the plant has a model of: the SocketCAN adapter",
    "bursts outlive an interface that is down": "the same",
    "a terminal that is closed": "no plant has signals",
    "stopped words to the first drive alone": "NMT stops its node, too; unit/proof/seeded.toml has it",
    "the witness takes a new bridge for somebody else": "in the second after a start nothing of it is judged",
}
"""Mutants that no plant can find, and why."""
TAKEN_BACK: Final = Path(__file__).with_name("taken_back")
"""Tables of mends that are taken back, each in a file of its own."""
_HALVES: Final = ("first", "second")
_RULES: Final = (
    ("a whole is as bad", "a whole is said"),
    ("a whole is as bad", "condition is said to be"),
    ("the reaction", "is to react by"),
    ("the reaction", "is to hold, and"),
    ("the reaction", "its setpoint is sent on"),
    ("silence", "is to be silent"),
    ("silence", "its silence"),
    ("no stop without a cause", "for no reason"),
    ("owed stops", "gets no stop though"),
    ("owed stops", "gets no NMT stop"),
    ("owed stops", "by a service that ends"),
    ("owed stops", "before SYNC brings"),
    ("dead is silent", "a dead bridge sends"),
    ("lost nodes", "its node is silent"),
    ("intruders are answered", "is not answered"),
    ("intruders are answered", "and nobody stops it"),
    ("ignored stops", "ignores its stop"),
    ("stopped outputs", "outputs that"),
    ("nobody but the owner", "somebody else sets"),
    ("nobody but the owner", "is set by who may not"),
    ("the witness speaks", "the witness does not say"),
    ("the witness is right", "the witness says"),
    ("in order again", "everything is in order"),
    ("causes first", "stands beside it"),
    ("causes first", "is not said to be silent"),
    ("in time", "ms after its controller's last telegram"),
    ("in time", "ms after the bridge fell silent"),
    ("asked for", "has not asked for it"),
    ("one owner", "setpoint of a stranger"),
    ("one bridge", "another bridge sends"),
    ("one bridge", "second bridge"),
    ("one bridge", "another bridge is in charge"),
    ("good is true", "is said to be good"),
    ("answers are true", "is read as"),
    ("image is drive", ", and the drive has "),
    ("words are kept", "that nobody has sent"),
    ("it stops by itself", "still runs"),
    ("answers are true", "', and "),
    ("answers are true", "its front shows"),
    ("followed is true", "followed, and"),
    ("causes are told", "no event says so"),
    ("one answer", "has no answer"),
    ("one answer", "that nobody has got"),
    ("one answer", "is answered twice"),
    ("nothing fails", "Traceback"),
)


@dataclass(frozen=True, slots=True)
class Kill:
    """How a mutant was found: the rule, and what it said; both empty where it was not."""

    mutant: str
    rule: str
    found: str
    half: str
    seed: int
    cpu_s: float
    false: str = ""
    """What is wrong in the program as it is, by the same plan."""


def tables(path: Path) -> tuple[Mutant, ...]:
    """Mutants of a table, or of those in a folder."""
    files = sorted(path.glob("*.toml")) if path.is_dir() else [path]
    return tuple(mutant for file in files for mutant in load(file))


def rule_of(found: str) -> str:
    """The rule of docs/explanation/plant-in-a-seed.md that says so."""
    return next((rule for rule, part in _RULES if part in found), "?") if found else ""


def play(tree: Path, half: str, first: str, *options: str) -> dict[str, Any]:
    """Plants of the program in ``tree``."""
    environment = {
        **os.environ,
        "PROOF_PLANT": half,
        "PYTHONPATH": f"{tree}{os.pathsep}{REPOSITORY}",
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    command = [sys.executable, "-m", "tests.plant.leaning", "--first", first, *options]
    done = subprocess.run(command, cwd=tree, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        # What does not even come up is no finding.
        raise RuntimeError(done.stderr)
    return json.loads(done.stdout)


class Plain:
    """The program as it is: what is known of a plan is not played again."""

    def __init__(self, folder: Path) -> None:
        self._tree = Tree(folder).folder
        self._good: dict[tuple[str, str, int], float] = {}
        """Until when nothing is wrong in a plan."""

    def found(self, half: str, first: str, seed: int, until: float) -> str:
        """What is wrong until then."""
        key = half, first, seed
        if until <= self._good.get(key, 0.0):
            return ""
        found = play(self._tree, half, first, "--seed", str(seed), "--until", str(until))["found"]
        if not found:
            self._good[key] = until
        return found


def hunt(tree: Tree, plain: Plain, mutant: Mutant, seed: int, seconds: float) -> Kill:
    tree.hold(mutant)
    spent = 0.0
    for half in _HALVES:
        options = "--seed", str(seed), "--seconds", str(seconds / len(_HALVES))
        end = play(tree.folder, half, mutant.first, *options)
        spent += end["cpu_s"]
        if end["found"]:
            false = plain.found(half, mutant.first, end["seed"], end["played_s"])
            found = end["found"].strip().splitlines()
            rule = rule_of(end["found"])
            return Kill(mutant.name, rule, found[-1], half, end["seed"], round(spent, 1), false)
    return Kill(mutant.name, "", "", "", seed, round(spent, 1))


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("names", nargs="*")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--of", type=Path, default=TABLE)
    parser.add_argument("--json", type=Path)
    asked = parser.parse_args()
    mutants = [one for one in tables(asked.of) if one.name in asked.names or not asked.names]
    kills: list[Kill] = []
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as other:
        tree, plain = Tree(Path(folder)), Plain(Path(other))
        for mutant in mutants:
            kill = hunt(tree, plain, mutant, asked.seed, asked.seconds)
            kills.append(kill)
            print(_row(kill), flush=True)
            if asked.json:
                asked.json.write_text(json.dumps([asdict(one) for one in kills], indent=1) + "\n")
    found = sum(bool(kill.rule) for kill in kills)
    print(f"{found} of {len(kills)} were found")
    bad = [kill for kill in kills if kill.false or not (kill.rule or kill.mutant in ELSEWHERE)]
    return 1 if bad else 0


def _row(kill: Kill) -> str:
    if not kill.rule:
        return f"{kill.mutant}: NOT FOUND in {kill.cpu_s} s {ELSEWHERE.get(kill.mutant, '')}"
    false = f" FALSE: {kill.false}" if kill.false else ""
    where = f"{kill.half} half, seed {kill.seed}, {kill.cpu_s} s"
    return f"{kill.mutant}: {kill.rule} ({where}): {kill.found}{false}"


if __name__ == "__main__":
    sys.exit(main())
