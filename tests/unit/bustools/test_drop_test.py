"""The drop test says which time it has read of each drive, and why it waits for another one."""

from __future__ import annotations

import pytest

from bridge.bustools.drop_test import DropOutcome
from bridge.drive import DriveState, OwnJudgement, OwnVerdict
from bridge.drive.own_judgement import DriveWatch

STOPS, RUNS_ON, UNKNOWN = OwnVerdict.STOPS, OwnVerdict.RUNS_ON, OwnVerdict.UNKNOWN


def watch(setting: str, time_ms: float | None, verdict: OwnVerdict, why: str = "") -> DriveWatch:
    watches = "process_data" if setting.startswith("P151") else "heartbeat"
    return DriveWatch("own", watches, setting, time_ms, "", verdict, why)


PROCESS_DATA = watch("P151 = 500 ms", 500.0, STOPS)
HEARTBEAT = watch("1016:01 = node 127, 400 ms", 400.0, STOPS)
OF_ANOTHER = watch("1016:01 = node 3, 400 ms", 0.0, RUNS_ON, "1016:01 watches node 3, the bridge is 127")
DOES_NOTHING = watch("P151 = 500 ms", 500.0, RUNS_ON, "P155 = warning: it runs on")
OFF = watch("P151 = 0 (off)", 0.0, RUNS_ON, "P151 is 0 (off)")
NOT_READ = watch("P151 is not known", None, UNKNOWN, "P151 is not known")


@pytest.mark.parametrize("rpdos_alone", [False, True])
@pytest.mark.parametrize(
    "watches",
    [
        (PROCESS_DATA,),
        (HEARTBEAT,),
        (PROCESS_DATA, HEARTBEAT),
        (OF_ANOTHER,),
        (DOES_NOTHING,),
        (OFF,),
        (NOT_READ,),
        (OFF, HEARTBEAT),
        (),
    ],
)
def test_the_time_that_was_read_is_told(watches: tuple[DriveWatch, ...], rpdos_alone: bool) -> None:
    outcome = DropOutcome("fu1", OwnJudgement(watches), DriveState.UNKNOWN, rpdos_alone=rpdos_alone)
    told = outcome.own_text
    for one in watches:
        assert one.setting in told
    if outcome.own_ms:
        assert told.startswith(f"{outcome.own_ms:g} ms")
    elif OwnJudgement(watches).first is not None:
        assert told.startswith("none without RPDOs alone: heartbeat, guarding and SYNC go on")
    else:
        assert told.startswith(f"none that stops it: {OwnJudgement(watches).reason}")
