"""A zenoh router, until its input ends: ``zenoh_router.py ENDPOINT SETTINGS``."""

import json
import sys

import zenoh

config = zenoh.Config.from_json5(sys.argv[2])
config.insert_json5("mode", '"router"')
config.insert_json5("listen/endpoints", json.dumps([sys.argv[1]]))
config.insert_json5("scouting/multicast/enabled", "false")
with zenoh.open(config):
    print("ready", flush=True)
    sys.stdin.read()
