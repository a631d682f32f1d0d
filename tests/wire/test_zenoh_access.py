"""Who gets at the zenoh server, and what is said where it cannot be started."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from bridge.base.errors import Unavailable
from bridge.config import ZenohTable
from bridge.northbound.zenoh import ZenohServer
from tests.support.views import view_of
from tests.support.zenoh_peer import free_port
from tests.support.zenoh_rig import rig
from tests.support.zenoh_site import epoch, make_plant


async def test_a_taken_port_is_told_in_one_sentence() -> None:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    table = ZenohTable(listen=[endpoint])
    first, second = (
        ZenohServer(view_of(make_plant(), epoch_ns=epoch), table, "demo", time.monotonic) for _ in range(2)
    )
    await first.start()
    with pytest.raises(Unavailable, match=r"Address already in use.*another bridge"):
        await second.start()
    await second.close()
    await first.close()


async def test_with_users_only_they_come_in(tmp_path: Path) -> None:
    users = tmp_path / "users"
    users.write_text("bridge:secret\nplc:geheim\n")
    settings = {"user": "bridge", "password_file": str(users)}
    async with rig(login=("plc", "geheim"), **settings) as r:
        assert (await r.peer.ready())["peers"] == 1
        assert (await r.peer.value("drives/demo/bridge/drives_configured"))["v"] == 3
    for wrong in (("plc", "wrong"), ()):
        async with rig(login=wrong, **settings) as r:
            assert (await r.peer.ready())["peers"] == 0


def test_the_bridge_is_one_of_the_users(tmp_path: Path) -> None:
    users = tmp_path / "users"
    users.write_text("plc:geheim\n")
    for user, file, words in (
        ("bridge", users, "no line bridge"),
        ("plc", tmp_path / "none", "cannot be read"),
        ("plc", None, "belong together"),
        (None, users, "belong together"),
    ):
        table = ZenohTable(user=user, password_file=str(file) if file else None)
        with pytest.raises(Unavailable, match=words):
            ZenohServer(view_of(make_plant(), epoch_ns=epoch), table, "demo", time.monotonic)
