"""Endpoints of the site file: an IP address and a port."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.small_site import SMALL, faults, load


@pytest.mark.parametrize(
    "listen",
    ["127.0.0.1", "127.0.0.1:", "127.0.0.1:99999", "localhost:502", ":502", "127.0.0.1:x", "1.2.3:5"],
)
def test_an_endpoint_is_an_ip_address_and_a_port(tmp_path: Path, listen: str):
    assert faults(tmp_path, f'{SMALL}[modbus]\nlisten = "{listen}"\n')[0].startswith(
        "14: modbus.listen: must"
    )


@pytest.mark.parametrize("listen", ["0.0.0.0:502", "[::1]:502", "192.168.1.5:0"])
def test_these_are_endpoints(tmp_path: Path, listen: str):
    site = load(tmp_path, f'{SMALL}[modbus]\nlisten = "{listen}"\n')
    assert site.modbus
    assert site.modbus.listen == listen
