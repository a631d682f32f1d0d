"""An I/O block that we did not write: canopen.LocalNode with eight digital outputs (CiA 401, 6200h:01).

output_slave.py CHANNEL NODE_ID [deaf] [secret]

RPDO1 sets 6200h:01. With ``deaf`` it takes nothing any more once bit 7 has been set, as a valve that sticks;
with ``secret`` it does not let 6200h:01 be read.
"""

import sys
import time

import canopen
from canopen.objectdictionary import UNSIGNED8, UNSIGNED16, UNSIGNED32, ODRecord
from foreign_slave import record, variable

STUCK = 0x80


def dictionary(node_id: int, *, secret: bool) -> canopen.ObjectDictionary:
    od = canopen.ObjectDictionary()
    od.node_id = node_id
    od.add_object(variable("device type", 0x1000, 0, UNSIGNED32, 0x00020191, "ro"))
    od.add_object(variable("error register", 0x1001, 0, UNSIGNED8, 0, "ro"))
    od.add_object(variable("heartbeat", 0x1017, 0, UNSIGNED16, 0))
    record(od, 0x1018, "identity", *((UNSIGNED32, value) for value in (0x1234, 2, 3, 4)))
    record(od, 0x1400, "rpdo", (UNSIGNED32, 0x200 + node_id), (UNSIGNED8, 255))
    record(od, 0x1600, "rpdo mapping", (UNSIGNED32, 0x62000108))
    outputs = ODRecord("outputs", 0x6200)
    outputs.add_member(variable("largest", 0x6200, 0, UNSIGNED8, 1))
    outputs.add_member(variable("outputs 1 to 8", 0x6200, 1, UNSIGNED8, 0, "wo" if secret else "rw"))
    od.add_object(outputs)
    return od


def main(channel: str, node_id: int, *, deaf: bool, secret: bool) -> None:
    network = canopen.Network()
    node = network.create_node(node_id, dictionary(node_id, secret=secret))
    network.connect(interface="socketcan", channel=channel)
    node.rpdo.read()
    held = [0]

    def take(rpdo: canopen.pdo.PdoMap) -> None:
        if node.nmt.state == "OPERATIONAL" and not (deaf and held[0] & STUCK):
            held[0] = rpdo[0].raw
            node.set_data(0x6200, 1, bytes(held))

    node.rpdo[1].subscribe()
    node.rpdo[1].add_callback(take)
    node.nmt.send_command(0)  # boot-up
    print("the I/O block is there", flush=True)
    while True:
        time.sleep(1)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), deaf="deaf" in sys.argv[3:], secret="secret" in sys.argv[3:])
