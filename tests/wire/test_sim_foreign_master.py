"""The simulated node against somebody else's master: the SDO client of the ``canopen`` library."""

from __future__ import annotations

import canopen
import pytest

from bridge.canopen.frame import Frame
from bridge.sim.nord.nord_tu4 import NordTu4


class DirectNetwork(canopen.Network):
    """Hands every frame of the library to the node and the answers back, without a bus or a thread."""

    def __init__(self, node: NordTu4) -> None:
        super().__init__()
        self._sim = node

    def send_message(self, can_id, data, remote=False) -> None:
        self._sim.on_frame(Frame(can_id, bytes(data)), 1.0)
        for frame in self._sim.take_frames():
            self.notify(frame.can_id, bytearray(frame.data), 1.0)


@pytest.fixture
def remote():
    node = NordTu4(5)
    node.start(0.5)
    node.take_frames()
    network = DirectNetwork(node)
    return network.add_node(canopen.RemoteNode(5, canopen.ObjectDictionary()))


def test_a_foreign_client_reads_the_name_and_writes_a_ramp(remote):
    assert remote.sdo.upload(0x1008, 0) == b"SK TU4-CAO"
    remote.sdo.download(0x2066, 1, (103).to_bytes(2, "little"))
    assert remote.sdo.upload(0x2066, 1) == (103).to_bytes(2, "little")


def test_a_foreign_client_may_write_in_segments(remote):
    remote.sdo.download(0x2066, 1, (104).to_bytes(2, "little"), force_segment=True)
    assert remote.sdo.upload(0x2066, 1) == (104).to_bytes(2, "little")


def test_a_foreign_client_understands_the_aborts(remote):
    with pytest.raises(canopen.SdoAbortedError) as read_only:
        remote.sdo.download(0x1000, 0, bytes(4))
    with pytest.raises(canopen.SdoAbortedError) as missing:
        remote.sdo.upload(0x5FFF, 0)
    assert (read_only.value.code, missing.value.code) == (0x0601_0002, 0x0602_0000)


def test_a_foreign_client_reads_and_changes_the_pdo_configuration(remote):
    remote.sdo.download(0x1A00, 0, b"\x00")
    remote.sdo.download(0x1A00, 1, (0x3001_0210).to_bytes(4, "little"))
    remote.sdo.download(0x1A00, 0, b"\x01")
    assert remote.sdo.upload(0x1A00, 1) == (0x3001_0210).to_bytes(4, "little")
    assert remote.sdo.upload(0x1A00, 0) == b"\x01"
