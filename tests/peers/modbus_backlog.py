"""A PLC that writes without waiting for answers, and hangs.

modbus_backlog.py PORT UNIT CONNECTIONS SECONDS
Waits for a line before each step: leads the drive to operation enabled, then fills its connections with
enabling telegrams for SECONDS, says when (monotonic) it gave the last one away, and stops itself.
"""

import os
import select
import signal
import socket
import struct
import sys
import time

port, unit, connections, seconds = int(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), float(sys.argv[4])


def write(word: int, setpoint: int) -> bytes:
    pdu = struct.pack(">BHHBHH", 16, 0, 2, 4, word, setpoint)
    return struct.pack(">HHHB", 1, 0, len(pdu) + 1, unit) + pdu


links = [socket.create_connection(("127.0.0.1", port), timeout=10) for _ in range(connections)]
for word in (0x047E, 0x047F):
    sys.stdin.readline()
    answer = b""
    while not answer.endswith(b"\x10\x00\x00\x00\x02"):  # a busy machine may have held it up
        links[0].sendall(write(word, 0x1000))
        answer = links[0].recv(256)
    print(f"{word:04X}", flush=True)
sys.stdin.readline()
backlog = write(0x047F, 0x1000) * 4000
for link in links:
    link.setblocking(False)
left = dict.fromkeys(links, b"")
end = time.monotonic() + seconds
written_at = 0.0
while time.monotonic() < end:
    readable, writable, _ = select.select(links, links, [], 0.01)
    for link in readable:
        link.recv(65536)
    for link in writable:
        data = left[link] or backlog
        left[link] = data[link.send(data) :]
        written_at = time.monotonic()
print(written_at, flush=True)
os.kill(os.getpid(), signal.SIGSTOP)
