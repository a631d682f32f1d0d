"""What README and docs say can be done: every command and script runs, its output is as shown.

How a page marks its blocks is described in ``tests/support/docs.py``.
"""

from __future__ import annotations

import socket
import time
import warnings
from collections.abc import Iterator
from pathlib import Path

import pytest
import zenoh
from asyncua.sync import Client as OpcUaClient
from pymodbus.client import ModbusTcpClient

from tests.support.docs import (
    Page,
    with_blocks,
)
from tests.support.docs_reader import Reader
from tests.support.process import Process, drivebridge, only_demo

DEMO_PORTS = {1502: "Modbus TCP", 4840: "OPC UA", 7447: "zenoh"}


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Process]:
    with only_demo():
        for port, name in DEMO_PORTS.items():
            with socket.socket() as probe:
                if probe.connect_ex(("127.0.0.1", port)) == 0:
                    pytest.fail(f"port {port} ({name}) is taken: end the demo or bridge that runs here")
        with drivebridge(tmp_path_factory.mktemp("demo"), "demo", "demo", notify=True) as process:
            process.wait_ready()
            process.wait_output("node operational")
            process.wait_output("OPC UA on")
            yield process


@pytest.fixture
def calm(demo: Process) -> None:
    """The demo's drives as they are at its start: no fault, no owner, switch-on inhibited."""
    with ModbusTcpClient("127.0.0.1", port=1502) as modbus:
        for address, word in ((11, 1), (0, 0x0400), (10, 0)):
            modbus.write_register(address, word, device_id=1)
    with OpcUaClient("opc.tcp://127.0.0.1:4840") as client:
        namespace = client.get_namespace_index("urn:drivebridge:points")
        fu2 = client.get_node(f"ns={namespace};s=conveyor/fu2")
        for method in ("ResetFault", "DisableVoltage", "ReleaseControl"):
            fu2.call_method(f"{namespace}:{method}")
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", '["tcp/127.0.0.1:7447"]')
    with zenoh.open(config) as session:
        for leaf in ("reset_fault", "disable_voltage", "release_control"):
            list(session.get(f"drives/demo/conveyor/fu3/command/{leaf}", payload="{}"))
    time.sleep(0.3)  # the acknowledge edge is on the bus that long, and the drives answer


@pytest.fixture
def reader(tmp_path: Path) -> Iterator[Reader]:
    reader = Reader(tmp_path)
    yield reader
    reader.end()


@pytest.mark.landing(3)
@pytest.mark.parametrize("page", with_blocks("console", "python"), ids=repr)
def test_what_a_page_does_can_be_done(page: Page, demo: Process, calm: None, reader: Reader) -> None:
    reader.work_through(page, demo)
    if reader.skipped:
        warnings.warn(f"mbpoll is missing; not run: {', '.join(reader.skipped)}", stacklevel=1)
