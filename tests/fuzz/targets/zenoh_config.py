"""Configuration of the fuzzers' sessions of zenoh."""

from __future__ import annotations

import json

import zenoh


def configure(port: int, mode: str = "client") -> zenoh.Config:
    config = zenoh.Config()
    config.insert_json5("mode", json.dumps(mode))
    config.insert_json5("listen/endpoints", "[]")
    config.insert_json5("connect/endpoints", json.dumps([f"tcp/127.0.0.1:{port}"]))
    config.insert_json5("connect/timeout_ms", "2000")
    config.insert_json5("scouting/multicast/enabled", "false")
    return config
