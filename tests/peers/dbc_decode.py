"""Somebody with cantools alone: decodes the last frame of each message of a log, as JSON.

dbc_decode.py FILE.dbc LOG, where LOG has lines as candump writes them: ``(1.5) can0 185#0102``
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import cantools


def main(file: str, log: str) -> None:
    database = cantools.database.load_file(file)
    last: dict[int, bytes] = {}
    for line in Path(log).read_text(encoding="ascii").splitlines():
        frame = line.split()[2]
        identifier, _, data = frame.partition("#")
        last[int(identifier, 16)] = bytes.fromhex(data)
    found: dict[str, object] = {}
    unknown = sorted(set(last) - {message.frame_id for message in database.messages})
    for message in database.messages:
        if message.frame_id not in last:
            continue
        data = last[message.frame_id]
        values = message.decode(data, decode_choices=False, allow_truncated=True)
        groups: dict[str, int] = {}
        bits: dict[str, object] = {}
        for group in message.signal_groups or []:
            signals = [message.get_signal_by_name(name) for name in group.signal_names]
            base = min(signal.start for signal in signals)
            groups[group.name] = sum(int(values[s.name]) << s.start - base for s in signals)
            bits |= {signal.name: values.pop(signal.name) for signal in signals}
        found[message.name] = {"sender": message.senders, "values": values, "words": groups, "bits": bits}
    print(json.dumps({"messages": found, "unknown": unknown}))


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2])
