"""A plant served by zenoh, and a second process that speaks plain zenoh to it."""

from __future__ import annotations

import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from bridge.command import Drive, Plant
from bridge.config import ZenohTable
from bridge.northbound.zenoh import ZenohServer
from tests.support.views import view_of
from tests.support.zenoh_peer import Peer, free_port, until, zenoh_peer
from tests.support.zenoh_site import epoch, make_plant

TOP = "drives/demo"
FU3 = f"{TOP}/conveyor/fu3"


class Rig:
    def __init__(self, plant: Plant, peer: Peer, endpoint: str) -> None:
        self.plant = plant
        self.peer = peer
        self.endpoint = endpoint

    @property
    def fu3(self) -> Drive:
        return self.plant.drives["conveyor/fu3"]

    @property
    def on_the_bus(self) -> tuple[int, ...]:
        return self.fu3.channel.output.words

    async def sees(self, key: str, **wanted: object) -> None:
        """The peer's subscription has brought a value with these fields."""

        def is_there() -> bool:
            latest = self.peer.latest(key) or {}
            return wanted.items() <= latest.items()

        await until(is_there, f"{key} with {wanted}, not {self.peer.latest(key)}")


@asynccontextmanager
async def rig(
    *,
    login: tuple[str, ...] = (),
    mode: str = "peer",
    router: str = "",
    further: int = 0,
    room: int = 0,
    **settings: object,
) -> AsyncIterator[Rig]:
    """A peer in ``mode``, connected to the server, or to the ``router`` to which the server connects, too.
    The plant has so many ``further`` nodes. So many bytes find ``room`` in the server's sockets, as on a
    network: on loopback it would be megabytes."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    plant = make_plant(further=further)
    sockets = f"#so_sndbuf={room}" if room else ""
    places = {"connect": [router], "listen": []} if router else {"listen": [endpoint + sockets]}
    table = ZenohTable.model_validate({**places, **settings})
    server = ZenohServer(view_of(plant, epoch_ns=epoch), table, "demo", time.monotonic)
    await server.start()
    try:
        async with zenoh_peer(router or endpoint, *login, mode=mode) as peer:
            yield Rig(plant, peer, router or endpoint)
    finally:
        begin = time.monotonic()
        await server.close()
        assert time.monotonic() - begin < 2.5
