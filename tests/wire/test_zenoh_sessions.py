"""One owner is one session: two zenoh sessions of one name are two controllers (docs/adr/0009)."""

from __future__ import annotations

from bridge.command.drive_link import NodeState
from tests.support.zenoh_peer import Peer, until, zenoh_peer
from tests.support.zenoh_rig import FU3, Rig, rig
from tests.support.zenoh_site import READY, drive_says, node_is

SHUT_DOWN, RUN = 0x047E, 0x047F
"""NORD's (BU 2500 §6.8)."""
WORD = f"{FU3}/command/control_word"


async def runs(r: Rig, peer: Peer, **who: str) -> None:
    node_is(r.plant, NodeState.OPERATIONAL)
    drive_says(r.fu3, READY)
    for word in (SHUT_DOWN, RUN):
        assert (await peer.command(WORD, word, "plc", **who))["ok"]
    assert r.on_the_bus[0] == RUN


async def test_two_programs_of_one_name_that_name_their_sessions_do_not_move_a_drive_in_turns() -> None:
    async with rig() as r, zenoh_peer(r.endpoint) as other:
        await runs(r, r.peer, session="one")
        for session in ("another", None):
            refused = await other.command(WORD, SHUT_DOWN, "plc", session=session)
            assert refused["code"] == "not_allowed"
            assert refused["message"] == "the drive is controlled by zenoh:plc session one"
            assert r.on_the_bus[0] == RUN
            assert (await r.peer.command(WORD, RUN, "plc", session="one"))["ok"]
        assert (await other.command(f"{FU3}/command/stop", {}, "plc", session="another"))["ok"]
        assert r.on_the_bus[0] != RUN


async def test_zenohs_own_sessions_are_told_apart_and_one_that_has_ended_is_followed_by_the_next() -> None:
    async with rig() as r, zenoh_peer(r.endpoint) as other:
        async with zenoh_peer(r.endpoint) as one:
            await runs(r, one, source="own")
            refused = await other.command(WORD, SHUT_DOWN, "plc", source="own")
            assert refused["code"] == "not_allowed"
            assert "zenoh:plc session " in refused["message"]
            assert (await one.command(WORD, RUN, "plc", source="own"))["ok"]
        owner = r.fu3.channel
        await until(
            lambda: owner.owner and not owner.owner.connection, "the bridge knows that it has ended", 0.9
        )
        assert (await other.command(WORD, RUN, "plc", source="own"))["ok"]
        assert r.on_the_bus[0] == RUN
        assert owner.trips == 0
