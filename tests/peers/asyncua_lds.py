"""asyncua's server as an older local discovery server, which knows RegisterServer and not RegisterServer2.

Run as ``-m tests.peers.asyncua_lds PORT CERTIFICATE KEY``. It ends with its standard input. What it knows
clients learn by FindServers.
"""

from __future__ import annotations

import asyncio
import sys
from typing import Any

from asyncua import Server, ua
from asyncua.common.utils import ServiceError
from asyncua.server.internal_server import InternalServer
from asyncua.server.uaprocessor import UaProcessor

REGISTER = ua.NodeId(ua.ObjectIds.RegisterServerRequest_Encoding_DefaultBinary)
REGISTER_2 = ua.NodeId(ua.ObjectIds.RegisterServer2Request_Encoding_DefaultBinary)


class Discovery(InternalServer):
    def register_server(self, server: Any, conf: Any = None) -> None:
        super().register_server(server, conf)
        if not server.IsOnline:
            del self._known_servers[server.ServerUri]


def grow_old() -> None:
    """Answer RegisterServer2 as a server that has never heard of it, and register nobody without security."""
    process = UaProcessor._process_message

    async def older(self: Any, typeid: ua.NodeId, *rest: Any) -> Any:
        if typeid == REGISTER_2:
            raise ServiceError(ua.StatusCodes.BadServiceUnsupported)
        if typeid == REGISTER and self._connection.security_policy.Mode is ua.MessageSecurityMode.None_:
            raise ServiceError(ua.StatusCodes.BadSecurityChecksFailed)
        return await process(self, typeid, *rest)

    setattr(UaProcessor, "_process_message", older)  # noqa: B010


async def main() -> None:
    port, certificate, key = sys.argv[1:]
    grow_old()
    server = Server(iserver=Discovery())
    await server.init()
    await server.set_application_uri("urn:lds")
    server.set_endpoint(f"opc.tcp://127.0.0.1:{port}")
    server.set_security_policy([ua.SecurityPolicyType.Basic256Sha256_SignAndEncrypt])
    await server.load_certificate(certificate)
    await server.load_private_key(key)
    async with server:
        print("ready", flush=True)
        await asyncio.to_thread(sys.stdin.read)


if __name__ == "__main__":
    asyncio.run(main())
