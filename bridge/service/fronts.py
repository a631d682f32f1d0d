"""Table of the service's fronts, which the bus process starts and ``run --role`` runs.

What a front is made of is imported when it is needed: the bus process serves none of them, and a front
nothing of another's.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Coroutine
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any, Final, Generic, TypeVar

from bridge.config import OpcUaTable, PageTable, Site, ZenohTable
from bridge.northbound.listening import Port

Settings = TypeVar("Settings")
"""Table of a front in the site file."""


class ProcessRole(StrEnum):
    """Processes of the service, as ``run --role`` names them."""

    ALL = "all"
    BUS = "bus"
    OPCUA = "opcua"
    PAGE = "page"
    ZENOH = "zenoh"


RunFront = Callable[[Path, int | None, int | None], Coroutine[None, None, None]]
"""Reads the site file at a path; what it returns serves until cancelled, with signs of life on the pipe that
comes second as soon as it serves, and on the socket that comes last where the bus process holds its port.
Raises ``BridgeError``."""


@dataclass(frozen=True, slots=True)
class FrontKind(Generic[Settings]):
    """A front: ``settings`` gives its table of the site file, None where the site does not have the front,
    and ``run`` what its process does.

    ``check`` looks at the files that the settings of the site file at a path name, before a bus is opened. A
    front that listens on one port has ``port``, which the bus process holds for it; one that opens sockets
    itself has ``check_ports``. Both raise ``Unavailable``. Clients of a ``is_prompt`` one command drives over
    and over, and wait for each answer: it is as important as the bus process itself, which is ahead of it all
    the same where its unit gives it a real-time priority. Clients of one with ``notice_s`` are given so many
    seconds between the announcement that it ends and its end.
    """

    role: ProcessRole
    settings: Callable[[Site], Settings | None]
    run: Callable[[], RunFront]
    check: Callable[[Settings, Site, Path], None] | None = None
    port: Callable[[Settings], Port] | None = None
    check_ports: Callable[[Settings], Awaitable[None]] | None = None
    is_prompt: bool = False
    notice_s: Callable[[Settings], float] | None = None

    def check_files(self, site: Site, path: Path) -> None:
        """Check the files of the front, where the ``site`` at ``path`` has it. Raises ``FileFaults`` and
        ``Unavailable``."""
        settings = self.settings(site)
        if settings is not None and self.check:
            self.check(settings, site, path)


def _run_opcua() -> RunFront:
    from bridge.service.opcua_front import run_opcua

    return run_opcua


def _check_opcua(settings: OpcUaTable, site: Site, path: Path) -> None:
    from bridge.northbound.opcua.preflight import check_opcua

    check_opcua(settings, Path(site.site.state_dir), path)


def _run_page() -> RunFront:
    from bridge.service.page_front import run_page

    return run_page


def _check_page(settings: PageTable, _: Site, path: Path) -> None:
    from bridge.northbound.page.preflight import check_page

    check_page(settings, path)


def _run_zenoh() -> RunFront:
    from bridge.service.zenoh_front import run_zenoh

    return run_zenoh


def _check_zenoh(settings: ZenohTable, _: Site, __: Path) -> None:
    from bridge.northbound.zenoh.preflight import check_zenoh

    check_zenoh(settings)


async def _check_zenoh_ports(settings: ZenohTable) -> None:
    from bridge.northbound.zenoh.preflight import check_ports

    await check_ports(settings)


FRONTS: Final[tuple[FrontKind[Any], ...]] = (
    FrontKind(
        ProcessRole.OPCUA,
        lambda site: site.opcua,
        _run_opcua,
        _check_opcua,
        port=lambda settings: Port(settings.listen, "opcua.listen"),
        notice_s=lambda settings: settings.shutdown_notice_s,
    ),
    FrontKind(
        ProcessRole.PAGE,
        lambda site: site.page,
        _run_page,
        _check_page,
        port=lambda settings: Port(settings.listen, "page.listen"),
    ),
    FrontKind(
        ProcessRole.ZENOH,
        lambda site: site.zenoh,
        _run_zenoh,
        _check_zenoh,
        check_ports=_check_zenoh_ports,
        is_prompt=True,
    ),
)
