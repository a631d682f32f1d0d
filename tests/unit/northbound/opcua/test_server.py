"""The server of the bridge before it serves; whole ones are tested by their wire."""

from __future__ import annotations

import socket
from datetime import UTC, datetime
from pathlib import Path

import pytest

from bridge.base.errors import FileFaults, Unavailable
from bridge.config import OpcUaTable, UserTable
from bridge.northbound.opcua.server import OpcUaServer, built_at
from tests.support.opcua_site import LocalView, make_plant


def server(folder: Path, **settings: object) -> OpcUaServer:
    table = OpcUaTable.model_validate({"listen": "127.0.0.1:0", "no_security": True, **settings})
    return OpcUaServer(LocalView(make_plant()), table, folder, "hall 3")


@pytest.mark.parametrize(
    ("listen", "names", "url"),
    [
        ("127.0.0.1:4840", [], "opc.tcp://127.0.0.1:4840/drivebridge"),
        ("[::1]:4840", [], "opc.tcp://[::1]:4840/drivebridge"),
        ("0.0.0.0:4840", ["box.example"], "opc.tcp://box.example:4840/drivebridge"),
        ("[::]:4840", ["box.example"], "opc.tcp://box.example:4840/drivebridge"),
    ],
)
def test_clients_are_told_a_name_by_which_they_reach_it(
    tmp_path: Path, listen: str, names: list[str], url: str
) -> None:
    assert server(tmp_path, listen=listen, names=names).endpoint_url == url


def test_a_server_on_all_interfaces_has_the_name_of_its_machine(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(socket, "gethostname", lambda: "hall-3")
    assert server(tmp_path, listen="0.0.0.0:4840").endpoint_url == "opc.tcp://hall-3:4840/drivebridge"


async def test_a_port_that_is_taken_is_named_and_nothing_is_left_open(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        made = server(tmp_path, listen=f"127.0.0.1:{taken.getsockname()[1]}")
        with pytest.raises(Unavailable, match=r"opcua\.listen"):
            await made.start()
    await made.close()
    await made.close()


async def test_a_user_without_a_hash_is_a_fault_of_the_site_file(tmp_path: Path) -> None:
    table = UserTable(name="anna", role="operator", password_hash="swordfish")
    made = server(tmp_path, user=[table.model_dump()])
    with pytest.raises(FileFaults):
        await made.start()
    await made.close()


def test_it_was_built_when_its_newest_file_was_written() -> None:
    assert datetime(2020, 1, 1, tzinfo=UTC) < built_at() <= datetime.now(UTC)
