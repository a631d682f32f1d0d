"""Reads a drive's words over one connection every 2 ms, until SIGTERM: watch_modbus.py PORT UNIT REPORT

REPORT becomes a JSON file: when value 1 was seen to be what, as [monotonic s, value] of each new one.
"""

import itertools
import socket
import struct
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.peers.last_words import report_on_sigterm

PERIOD_S = 0.002
WORDS = 4
_ANSWER = struct.Struct(f">HHHBBB{WORDS}H")
_HEAD = 6


def received(stream: socket.socket, count: int) -> bytes:
    data = b""
    while len(data) < count:
        more = stream.recv(count - len(data))
        if not more:
            raise SystemExit("the server has closed the connection")
        data += more
    return data


def answer(stream: socket.socket) -> bytes:
    head = received(stream, _HEAD)
    return head + received(stream, int.from_bytes(head[4:], "big"))


def connected(port: int) -> socket.socket:
    """The server may still be starting."""
    while True:
        try:
            stream = socket.create_connection(("127.0.0.1", port))
        except ConnectionRefusedError:
            time.sleep(0.1)
            continue
        stream.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return stream


def main(port: int, unit: int, report: Path) -> None:
    seen: list[tuple[float, int]] = []
    report_on_sigterm(report, lambda: {unit: seen})
    latest = 0
    with connected(port) as stream:
        next_at = time.monotonic()
        for number in itertools.count():
            stream.sendall(struct.pack(">HHHBBHH", number & 0xFFFF, 0, 6, unit, 4, 0, WORDS))
            data = answer(stream)
            now = time.monotonic()
            # Refused where nothing has come yet.
            value = _ANSWER.unpack(data)[7] if len(data) == _ANSWER.size else latest
            if value != latest:
                latest = value
                seen.append((now, value))
            if not number:
                print("watching", flush=True)
            next_at = max(next_at + PERIOD_S, now)
            time.sleep(max(0.0, next_at - now))


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3]))
