"""Composition root of the page's front: a web server on the mirror image, and nothing else."""

from __future__ import annotations

import logging
from collections.abc import Coroutine
from contextlib import AsyncExitStack
from importlib.util import find_spec
from pathlib import Path

from bridge.base import clock
from bridge.catalogue import Catalogue
from bridge.config import Site
from bridge.exports import dbc_file, modbus_table, opcua_table, zenoh_table
from bridge.lint import dictionary_files
from bridge.northbound.listening import ListeningSocket, listen
from bridge.northbound.page.integration import Export
from bridge.northbound.page.server import PageServer
from bridge.northbound.page.web import Page, PageSources
from bridge.northbound.view import View
from bridge.parameter.ledger_file import LedgerFile
from bridge.project import Project, load_project
from bridge.service.fault_texts import german_faults
from bridge.service.mirrored import required, serve_mirrored
from bridge.service.page.buses import Buses
from bridge.service.page.system_facts import SystemOf, store_of

_log = logging.getLogger(__name__)


def _kept_sessions(site: Site) -> Path:
    """File of the sessions, beside the socket of the mirror: the folder is ours alone, and empty after a
    boot."""
    return Path(site.site.runtime_dir).absolute() / f"{site.site.name}-page.sessions"


def exports_of(project: Project) -> dict[str, Export]:
    """Exports as ``drivebridge export`` prints them, by file name."""
    tables = {"modbus": modbus_table, "opcua": opcua_table, "zenoh": zenoh_table}
    if project.site.zenoh is None:
        del tables["zenoh"]
    exports: dict[str, Export] = {}
    for name, table in tables.items():
        exports[f"{name}.csv"] = lambda table=table: table(project).as_csv()
        exports[f"{name}.json"] = lambda table=table: table(project).as_json()
    # The library for them is an extra: what cannot be made is not offered.
    for place, bus in enumerate(project.site.bus if find_spec("cantools") else ()):
        exports[f"{bus.name}.dbc"] = lambda place=place: dbc_file(project, place)
    return exports


def sources_of(project: Project) -> PageSources:
    """Sources of the page: files, buses and system of ``project``."""
    buses, site = Buses(project, clock.epoch_ns), project.site
    state_dir = Path(site.site.state_dir)
    return PageSources(
        {"de": german_faults(project.families)},
        exports_of(project),
        buses.taps(),
        buses.layouts(),
        buses.capture,
        LedgerFile(state_dir).totals,
        dictionary_files(project.families, project.path),
        SystemOf(project),
        store_of(site.opcua, state_dir) if site.opcua else None,
    )


def run_page(path: Path, signs: int | None, listening: int | None) -> Coroutine[None, None, None]:
    """The front of the page of the site file at ``path``, as ``RunFront`` says."""
    project = load_project(path)
    site = project.site
    table, key = required(site.page, "page"), "page.listen"

    async def open_server(mirror: View, stack: AsyncExitStack) -> PageServer:
        bound = listen(table.listen, key) if listening is None else ListeningSocket(listening, key)
        catalogue = Catalogue.of(site, project.families)
        page = Page(mirror, catalogue, sources_of(project), clock.now, _kept_sessions(site))
        server = PageServer(page, bound, table.certificate, table.private_key)
        await server.start()
        stack.push_async_callback(server.close)
        scheme = "http" if table.certificate is None else "https"
        _log.info("the page is served on %s://%s", scheme, table.listen)
        return server

    return serve_mirrored(site, "page", open_server, signs)
