"""canopen's LSS master against our test slave: a master that we did not write understands it."""

from __future__ import annotations

import pytest
from canopen.lss import LssMaster

from tests.support.lss_slave import CONFIGURATION, LssSlave

IDENTITY = (0x38, 0x10203, 7, 0x1234_5678)


class DirectNetwork:
    """Hands each request to the slave and its answer straight back."""

    def __init__(self, slave: LssSlave, master: LssMaster) -> None:
        self.slave, self.master = slave, master

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        assert (can_id, remote) == (0x7E5, False)
        answer = self.slave.on_request(bytes(data))
        if answer is not None:
            self.master.on_message_received(0x7E4, bytearray(answer), 0.0)


@pytest.fixture
def slave() -> LssSlave:
    return LssSlave(IDENTITY)


@pytest.fixture
def master(slave: LssSlave) -> LssMaster:
    master = LssMaster()
    master.RESPONSE_TIMEOUT = 0.001
    master.network = DirectNetwork(slave, master)
    return master


def test_it_finds_the_slave_by_fastscan(master: LssMaster, slave: LssSlave) -> None:
    assert master.fast_scan() == (True, list(IDENTITY))
    assert slave.state == CONFIGURATION


def test_it_selects_asks_sets_and_stores(master: LssMaster, slave: LssSlave) -> None:
    assert master.send_switch_state_selective(*IDENTITY)
    assert tuple(master.inquire_lss_address(command) for command in range(0x5A, 0x5E)) == IDENTITY
    master.configure_node_id(17)
    master.configure_bit_timing(3)
    master.store_configuration()
    assert slave.stored == (17, 3)
    master.send_switch_state_global(master.WAITING_STATE)
    assert slave.node_id == 17
