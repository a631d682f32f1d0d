"""Always the same cases, at two protocols at a time. ``make fuzz`` takes longer, and other seeds."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest
from asyncua import ua
from asyncua.common.utils import Buffer
from asyncua.ua.ua_binary import struct_from_binary

from tests.fuzz.case import load
from tests.fuzz.judge import Judge
from tests.fuzz.rig import Rig, running_rig
from tests.fuzz.run import fuzz
from tests.fuzz.targets.opcua_admin import AdminChannel
from tests.fuzz.targets.opcua_channel import Channel, type_name
from tests.support.nightly import examples

CASES: Final = (
    {"opcua": examples(1600, 600), "can": examples(1800, 700)},
    {"modbus": examples(1300, 500), "zenoh": examples(18_000, 7000)},
)
"""Number of cases that a machine of two cores throws in 20 s each by night; by day the first of them."""
SEED: Final = 13
"""The same each time: a test suite that finds something new each day is no test of a change."""
CARRIED_OUT: Final = (
    "Read from the drive",
    "TakeControl",
    "Items for events",
    "An item is changed",
    "History, raw",
    "History, at times",
    "History, events",
    "Acknowledge",
    "TimedShelve",
    "ConditionRefresh2",
    "Read of a black box",
    "GetMonitoredItems",
    "ServerConfiguration_CreateSigningRequest",
    "TrustList_AddCertificate",
)
"""What changed messages begin with has to get far: these are not refused as they are."""
LIMIT_S: Final = 300.0
MOST_LOOKS: Final = 10
"""More than a good client's own patience."""
LOSING: Final = ("zenoh", "zenoh, newly connected")
"""zenoh's client now and then loses what it asks in the moment in which it gives up a connection."""


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Rig]:
    folder: Path = tmp_path_factory.mktemp("fuzz")
    with running_rig(folder) as rig:
        yield rig


@pytest.mark.timeout(LIMIT_S)
def test_what_is_changed_is_good_before(rig: Rig) -> None:
    """Before anything else is thrown: an alarm is acknowledged once."""
    recorded = {one.what: one.case for one in load("opcua").recorded}
    codes: dict[str, str] = {}
    for what in CARRIED_OUT:
        case = recorded[what]
        channel = AdminChannel(rig) if case.kind == "admin" else Channel(rig.opcua)
        channel.hello()
        channel.open()
        channel.activate()
        body = channel.answered(case.parts[0])
        answer = struct_from_binary(getattr(ua, type_name(body)), Buffer(body))
        codes[what] = getattr(answer.Results[0], "StatusCode", answer.Results[0]).name
        channel.leave()
    assert codes == dict.fromkeys(CARRIED_OUT, "Good")


@pytest.mark.landing(2)
@pytest.mark.timeout(LIMIT_S + 180)
@pytest.mark.parametrize("cases", CASES, ids="+".join)
def test_what_is_thrown_at_it_is_borne(
    rig: Rig, cases: dict[str, int], capsys: pytest.CaptureFixture[str]
) -> None:
    report = fuzz(rig, tuple(cases), LIMIT_S, SEED, most=cases)
    with capsys.disabled():
        print(f"\n{report.told()}")
    assert not report.faults, report.told()
    assert report.thrown == cases


@pytest.mark.landing
@pytest.mark.timeout(LIMIT_S)
def test_fronts_that_stand_still_for_two_seconds_lose_no_good_client(rig: Rig) -> None:
    """As on a busy machine: a client whose library gives up after a second would be lost, and no log would
    have a line of it."""
    judge = Judge(rig)
    fronts = rig.fronts()
    for number in (signal.SIGSTOP, signal.SIGCONT):
        for pid in fronts:
            os.kill(pid, number)
        time.sleep(2.0)
    # Values that were old by then are said to be.
    judge.forgive(*LOSING)
    for _ in range(MOST_LOOKS):
        time.sleep(1.0)
        assert not judge.look()
        if judge.serves_again():
            break
    assert judge.serves_again()
