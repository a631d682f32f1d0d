"""open62541 as a local discovery server. Run as ``-m tests.peers.open62541_lds PORT CERTIFICATE KEY``.

It ends with its standard input. What it knows clients learn by FindServers.
"""

from __future__ import annotations

import sys
from pathlib import Path

import o6

_DISCOVERY_SERVER = 3


def main() -> None:
    port, certificate, key = sys.argv[1:]
    server = o6.Server(
        port=int(port),
        certificate=Path(certificate).read_bytes(),
        privateKey=Path(key).read_bytes(),
        applicationUri="urn:lds",
        acceptAllCertificates=True,
    )
    server.config.applicationType = _DISCOVERY_SERVER
    server.start()
    print("ready", flush=True)
    sys.stdin.read()
    server.stop()


if __name__ == "__main__":
    main()
