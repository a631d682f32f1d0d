"""A CANopen slave that we did not write: canopen.LocalNode, dressed as a SK TU4-CAO with one drive.

foreign_slave.py CHANNEL NODE_ID [asked] [latches]

Its object dictionary has what the master asks for. Each RPDO is answered by a TPDO whose status word is
that of a simple drive and whose first actual value is the setpoint. With ``asked`` the TPDO has type 253 and
comes on a remote frame only. With ``latches`` it keeps a SYNC of a wrong length as an error (EMCY 8240h) and
refuses Operational until its communication is reset.
"""

import sys
import time

import can
import canopen
from canopen.objectdictionary import (
    UNSIGNED8,
    UNSIGNED16,
    UNSIGNED32,
    VISIBLE_STRING,
    ODArray,
    ODRecord,
    ODVariable,
)

ON_REMOTE_FRAME = 253
START, ENTER_PRE_OPERATIONAL, RESET_NODE, RESET_COMMUNICATION = 0x01, 0x80, 0x81, 0x82
WRONG_LENGTH = 0x8240
READY, RUNNING, INHIBITED = 0x0B31, 0x0B37, 0x0B40


def variable(name: str, index: int, sub: int, kind: int, default: object, access: str = "rw") -> ODVariable:
    entry = ODVariable(name, index, sub)
    entry.data_type = kind
    entry.default = default
    entry.access_type = access
    entry.pdo_mappable = True
    return entry


def record(dictionary: canopen.ObjectDictionary, index: int, name: str, *entries: tuple[int, object]) -> None:
    """A record whose entries are (type, default), sub 0 the highest sub-index."""
    top = ODRecord(name, index)
    top.add_member(variable("largest", index, 0, UNSIGNED8, len(entries)))
    for sub, (kind, default) in enumerate(entries, 1):
        top.add_member(variable(f"{name} {sub}", index, sub, kind, default))
    dictionary.add_object(top)


def array(dictionary: canopen.ObjectDictionary, index: int, name: str, count: int) -> None:
    top = ODArray(name, index)
    top.add_member(variable("largest", index, 0, UNSIGNED8, count))
    for sub in range(1, count + 1):
        top.add_member(variable(f"{name} {sub}", index, sub, UNSIGNED16, 0))
    dictionary.add_object(top)


def dictionary(node_id: int) -> canopen.ObjectDictionary:
    od = canopen.ObjectDictionary()
    od.node_id = node_id
    od.add_object(variable("device type", 0x1000, 0, UNSIGNED32, 0x00010192, "ro"))
    od.add_object(variable("error register", 0x1001, 0, UNSIGNED8, 0, "ro"))
    record(od, 0x1003, "errors", (UNSIGNED32, 0))
    od.add_object(variable("device name", 0x1008, 0, VISIBLE_STRING, "canopen.LocalNode", "const"))
    od.add_object(variable("heartbeat", 0x1017, 0, UNSIGNED16, 0))
    record(od, 0x1018, "identity", *((UNSIGNED32, value) for value in (0x1234, 2, 3, 4)))
    communication = (UNSIGNED8, 255), (UNSIGNED16, 0), (UNSIGNED8, 0), (UNSIGNED16, 0)
    record(od, 0x1400, "rpdo", (UNSIGNED32, 0x200 + node_id), *communication)
    record(od, 0x1800, "tpdo", (UNSIGNED32, 0x180 + node_id), *communication)
    setpoints = [0x30020110, 0x30020210, 0x30020310]
    record(od, 0x1600, "rpdo mapping", *((UNSIGNED32, entry) for entry in (0x30000110, *setpoints)))
    actual_values = [entry + 0x10000 for entry in setpoints]
    record(od, 0x1A00, "tpdo mapping", *((UNSIGNED32, entry) for entry in (0x30010110, *actual_values)))
    array(od, 0x3000, "control word", 4)
    array(od, 0x3001, "status word", 4)
    array(od, 0x3002, "setpoint", 12)
    array(od, 0x3003, "actual value", 12)
    od.add_object(variable("digital inputs", 0x3005, 0, UNSIGNED16, 0x0005, "ro"))
    record(od, 0x2069, "P105", *[(UNSIGNED16, 500)] * 4)
    return od


def status_for(control: int) -> int:
    if control & 0x0402 != 0x0402:
        return INHIBITED
    return RUNNING if control & 0x0F == 0x0F else READY if control & 0x07 == 0x06 else INHIBITED


class Asked(can.Listener):
    """Answers remote frames, which canopen passes over."""

    def __init__(self, node: canopen.LocalNode) -> None:
        self._node = node

    def on_message_received(self, msg: can.Message) -> None:
        if msg.is_remote_frame and msg.arbitration_id == 0x180 + self._node.id:
            self._node.tpdo[1].transmit()


class Latch:
    """Between the network and the node's NMT."""

    def __init__(self, network: canopen.Network, node: canopen.LocalNode) -> None:
        self._node = node
        self._is_set = False
        network.unsubscribe(0, node.nmt.on_command)
        network.subscribe(0, self.on_nmt)
        network.subscribe(0x80, self.on_sync)

    def on_sync(self, can_id: int, data: bytes, timestamp: float) -> None:
        if data and not self._is_set:
            self._set(True)
            self._node.emcy.send(WRONG_LENGTH, 0x11)
            self._node.nmt.send_command(ENTER_PRE_OPERATIONAL)

    def on_nmt(self, can_id: int, data: bytes, timestamp: float) -> None:
        command, node_id = data
        if node_id not in (0, self._node.id) or (command == START and self._is_set):
            return
        if command not in (RESET_NODE, RESET_COMMUNICATION):
            self._node.nmt.on_command(can_id, data, timestamp)
            return
        if command == RESET_COMMUNICATION:
            self._set(False)
        self._node.nmt.send_command(command)  # boot-up
        self._node.nmt.send_command(ENTER_PRE_OPERATIONAL)

    def _set(self, is_set: bool) -> None:
        self._is_set = is_set
        self._node.sdo[0x1001].raw = 0x11 if is_set else 0
        self._node.sdo[0x1003][1].raw = WRONG_LENGTH


def main(channel: str, node_id: int, *, asked: bool, latches: bool) -> None:
    network = canopen.Network()
    node = network.create_node(node_id, dictionary(node_id))
    if asked:
        node.object_dictionary[0x1800][2].default = ON_REMOTE_FRAME
        network.listeners.append(Asked(node))
    network.connect(interface="socketcan", channel=channel)
    node.rpdo.read()
    node.tpdo.read()

    def answer(rpdo: canopen.pdo.PdoMap) -> None:
        control, setpoint = rpdo[0].raw, rpdo[1].raw
        node.tpdo[1][0].raw = status_for(control)
        node.tpdo[1][1].raw = setpoint if status_for(control) == RUNNING else 0
        if node.nmt.state == "OPERATIONAL" and not asked:
            node.tpdo[1].transmit()

    node.rpdo[1].subscribe()
    node.rpdo[1].add_callback(answer)
    if latches:
        Latch(network, node)
    node.nmt.send_command(0)  # boot-up
    print("the foreign slave is there", flush=True)
    while True:
        time.sleep(1)


if __name__ == "__main__":
    main(
        sys.argv[1],
        int(sys.argv[2]),
        asked="asked" in sys.argv[3:],
        latches="latches" in sys.argv[3:],
    )
