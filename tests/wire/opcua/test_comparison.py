"""The same requests to the bridge's OPC UA server, to open62541 and to node-opcua's: what differs is known.

``make compare`` asks more of them.
"""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.compare.cases import SETS
from tests.compare.run import compare
from tests.compare.servers import Servers, missing

SEED = 36
FEW, MORE = 5, 60


@pytest.fixture(scope="module")
def servers() -> Iterator[Servers]:
    if absent := missing():
        pytest.skip(absent)
    made = Servers()
    yield made
    made.close()


@pytest.mark.parametrize("service_set", SETS)
def test_others_answer_as_ours_but_for_what_is_known(servers: Servers, service_set: str) -> None:
    report = compare(servers, service_set, FEW, SEED)
    assert report.cases >= FEW
    assert not report.fault, report.fault


@pytest.mark.landing
@pytest.mark.parametrize("service_set", SETS)
def test_others_answer_more_as_ours(servers: Servers, service_set: str) -> None:
    report = compare(servers, service_set, MORE, SEED + 1)
    assert report.cases >= MORE
    assert not report.fault, report.fault
