"""A zenoh client: one query after another from its command line, each answer as one line of JSON.

zenoh_ask.py ENDPOINT KEY=PAYLOAD … ; an empty payload is a plain get. `@SECONDS` waits.
"""

import json
import sys
import time

import zenoh

endpoint, *questions = sys.argv[1:]
config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", json.dumps([endpoint]))
config.insert_json5("scouting/multicast/enabled", "false")
# The front that serves zenoh may still be starting.
config.insert_json5("connect/timeout_ms", "30000")
with zenoh.open(config) as session:
    for question in questions:
        if question.startswith("@"):
            time.sleep(float(question[1:]))
            continue
        key, _, payload = question.partition("=")
        answers = []
        for reply in session.get(key, payload=payload or None, timeout=10.0):
            if reply.ok is not None:
                answers.append({"key": str(reply.ok.key_expr), **json.loads(reply.ok.payload.to_string())})
            elif reply.err is not None:
                answers.append(json.loads(reply.err.payload.to_string()))
        print(json.dumps(answers), flush=True)
