"""Composition root of the OPC UA front: a server on the mirror image, and nothing else."""

from __future__ import annotations

import asyncio
import gc
from collections.abc import Coroutine, Mapping, Sequence
from contextlib import AsyncExitStack
from pathlib import Path

from bridge.catalogue import Catalogue
from bridge.config import Site
from bridge.mapping import Family
from bridge.mapping.site_families import load_site_and_families
from bridge.northbound.listening import ListeningSocket
from bridge.northbound.opcua.alarms.alarm_server import AlarmSite
from bridge.northbound.opcua.models.nameplates import nameplates_of
from bridge.northbound.opcua.server import OpcUaServer
from bridge.northbound.trouble_words import PlantWords
from bridge.northbound.view import View
from bridge.service.fault_texts import german_faults
from bridge.service.front_process import on_end
from bridge.service.mirrored import required, serve_mirrored


def alarm_site_of(site: Site, families: Mapping[str, Family]) -> AlarmSite:
    """Fronts of the site, and what its drives add to the words of their alarms."""
    drives = {
        f"{node.name}/{families[node.mapping_key].leaf_of(drive)}": (node.mapping_key, drive)
        for bus in site.bus
        for node in bus.node
        for drive in node.drive
    }
    tables = {"modbus": site.modbus, "opcua": site.opcua, "zenoh": site.zenoh, "page": site.page}
    german = german_faults(families)

    def fault_in(drive: str, number: str, language: str) -> Mapping[str, str]:
        if language != "de" or drive not in drives:
            return {}
        return german[drives[drive][0]].get(number, {})

    words = PlantWords(fault_in, {name: drive.on_expiry for name, (_, drive) in drives.items()})
    return AlarmSite(words, tuple(name for name, table in tables.items() if table is not None))


def _described(file: Path, folders: Sequence[Path], modules: Sequence[str]) -> Family:
    """Family of a device description; what reads them is imported where a site has one."""
    from bridge.derive import describe

    return describe(file, folders, modules)


def run_opcua(path: Path, signs: int | None, listening: int | None) -> Coroutine[None, None, None]:
    """The OPC UA front of the site file at ``path``, as ``RunFront`` says."""
    site, families = load_site_and_families(path, _described)
    settings = required(site.opcua, "opcua")
    nameplates = nameplates_of(Catalogue.of(site, families))

    alarm_site = alarm_site_of(site, families)

    async def open_server(mirror: View, stack: AsyncExitStack) -> OpcUaServer:
        # Nothing of what is built here is garbage, and looking for it takes a quarter of the time.
        gc.disable()
        stack.callback(gc.enable)
        bound = None if listening is None else ListeningSocket(listening, "opcua.listen")
        folder = Path(site.site.state_dir)
        server = OpcUaServer(mirror, settings, folder, site.site.name, bound, alarm_site, nameplates)
        await server.start()
        stack.push_async_callback(server.close)
        on_end(server.announce_end)

        async def give_notice(why: type[BaseException] | None, *_: object) -> None:
            # Not where the front has failed and is started again.
            if why is not None and issubclass(why, asyncio.CancelledError):
                await server.end()

        stack.push_async_exit(give_notice)
        gc.collect()
        gc.freeze()
        gc.enable()
        return server

    return serve_mirrored(site, "opcua", open_server, signs)
