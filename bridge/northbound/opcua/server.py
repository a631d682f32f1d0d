"""The OPC UA server of the bridge: brings layout, users and the server together."""

from __future__ import annotations

import asyncio
import logging
import socket
from collections.abc import Coroutine, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from asyncua.server.address_space import AddressSpace
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat

import bridge
from bridge.base import clock
from bridge.base.errors import OperationFailed
from bridge.config import OpcUaTable
from bridge.northbound.listening import listen, until_deaf
from bridge.northbound.opcua.accounts import Accounts, security_policies
from bridge.northbound.opcua.alarms.alarm_server import AlarmSite, of_certificate, serve_alarms
from bridge.northbound.opcua.alarms.alarms import AlarmTask
from bridge.northbound.opcua.backend import Backend
from bridge.northbound.opcua.certificates import server_configuration
from bridge.northbound.opcua.certificates.client_trust import ClientTrust, client_store
from bridge.northbound.opcua.certificates.own_certificate import OwnCertificate
from bridge.northbound.opcua.certificates.own_files import own_folder
from bridge.northbound.opcua.certificates.own_renewal import OwnRenewal
from bridge.northbound.opcua.certificates.ownnames import names_of, reached_by
from bridge.northbound.opcua.certificates.renewal_watch import RenewalWatch
from bridge.northbound.opcua.certificates.server_configuration import ServerConfiguration
from bridge.northbound.opcua.certificates.server_identity import ServerIdentity, server_identity
from bridge.northbound.opcua.change_publisher import Publisher
from bridge.northbound.opcua.events.event_file import EventLog
from bridge.northbound.opcua.events.event_keeper import EventKeeper
from bridge.northbound.opcua.events.event_records import EventCodec
from bridge.northbound.opcua.events.events import EventSender
from bridge.northbound.opcua.history.plant_history import PlantHistory
from bridge.northbound.opcua.history.value_rings import ValueRings
from bridge.northbound.opcua.models.assets import read_models
from bridge.northbound.opcua.models.nameplates import Nameplate
from bridge.northbound.opcua.models.site_space import NAMESPACE, SiteSpace, fill
from bridge.northbound.opcua.requests.methods import Caller
from bridge.northbound.opcua.requests.outcome_texts import spoken
from bridge.northbound.opcua.requests.read_through import ReadThrough
from bridge.northbound.opcua.requests.writes import Writer
from bridge.northbound.opcua.service_level import ServiceLevel
from bridge.northbound.opcua.space.nodes import ObjectNode, layout
from bridge.northbound.opcua.space.notifiers import Notifiers
from bridge.northbound.pulse import Pulse
from bridge.northbound.view import View
from bridge.text import LANGUAGES, Text
from bridge.uaserver import decoding
from bridge.uaserver.bound import BoundServer
from bridge.uaserver.connections.acceptor import WINDOW
from bridge.uaserver.inner_server import InnerServer
from bridge.uaserver.library import ua
from bridge.uaserver.librarylog import quieten
from bridge.uaserver.own_addresses import OwnAddresses
from bridge.uaserver.registration import RegisteredServer, Registration

_PRODUCT: Final = "urn:drivebridge"
_MB: Final = 1_000_000
_KEPT: Final = "opcua"
"""Folder in ``state_dir`` of what is kept of alarms and of the past."""

_log = logging.getLogger(__name__)

_Running = Coroutine[Any, Any, None]


class OpcUaServer:
    """Serves ``view`` as the contract's OPC UA section says.

    ``state_dir`` is the site's; certificates are in its folder ``certificates``, alarms and the past in
    ``opcua``. ``nameplates`` are those of the drives. ``bound`` is a listening socket where somebody else
    holds the port.
    """

    def __init__(
        self,
        view: View,
        settings: OpcUaTable,
        state_dir: Path,
        site_name: str,
        bound: socket.socket | None = None,
        alarm_site: AlarmSite | None = None,
        nameplates: Mapping[str, Nameplate] | None = None,
    ) -> None:
        self._view = view
        self._settings = settings
        self._state_dir = state_dir
        self._folder = state_dir
        self._kept = state_dir / _KEPT
        self._site_name = site_name
        self._nameplates = nameplates or {}
        self._alarm_site = alarm_site or AlarmSite()
        self._users: Accounts | None = None
        self._server: BoundServer | None = None
        self._socket = bound
        self._pulse = Pulse(clock.now)
        self._publisher: asyncio.Task[None] | None = None
        self._renewals: asyncio.Task[None] | None = None
        self._inner: InnerServer | None = None
        self._ending: asyncio.Task[None] | None = None
        self._registration: Registration | None = None
        self._registering: asyncio.Task[None] | None = None
        self._follower: asyncio.Task[None] | None = None
        self._alarms: AlarmTask | None = None
        self._past: PlantHistory | None = None
        host, _, port = settings.listen.rpartition(":")
        self._host = host.strip("[]")
        self.port = int(port)
        """The port that is listened on; after ``start`` never 0."""

    @property
    def endpoint_url(self) -> str:
        host = self._host
        if host in ("0.0.0.0", "::"):
            host = next(iter(self._settings.names), socket.gethostname())
        return f"opc.tcp://{f'[{host}]' if ':' in host else host}:{self.port}/drivebridge"

    async def start(self) -> None:
        """Open the endpoints.

        Raises ``FileFaults`` for a user, certificate or key that cannot be used, and ``Unavailable``
        where the port cannot be opened or the folder not be written.
        """
        store = client_store(self._settings, self._state_dir)
        store.prepare()
        self._users = Accounts(self._settings, store.lists)
        self._folder = own_folder(self._state_dir)
        own = await asyncio.to_thread(server_identity, self._settings, self._folder)
        trusted = ClientTrust(store, needs_trust=self._settings.trust == "list")
        bound = self._socket = self._socket or listen(self._settings.listen, "opcua.listen")
        bound.setblocking(False)
        # Connections inherit it: who fills their buffers is noticed.
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, WINDOW)
        self.port = bound.getsockname()[1]
        self._pulse.start()
        try:
            await self._serve(bound, own, trusted, self._users)
        except BaseException:
            await self.close()
            raise
        self._tell()

    async def failed(self) -> None:
        """Wait for ever, or raise ``OperationFailed`` when no client can connect any more or changes are not
        published."""
        if self._socket is None or self._publisher is None or self._follower is None:
            return
        deaf = asyncio.create_task(until_deaf(self._socket, "opcua.listen"))
        try:
            await asyncio.wait((deaf, self._publisher, self._follower), return_when=asyncio.FIRST_COMPLETED)
            if not deaf.done():
                raise OperationFailed("OPC UA: clients are told of no change any more")
            await deaf
        finally:
            deaf.cancel()

    def announce_end(self) -> None:
        """Tell clients, at once, that the server is going to end; nothing else is changed by that."""
        if self._inner and self._ending is None:
            self._ending = asyncio.create_task(self._tell_end(self._inner), name="opcua end")

    async def end(self) -> None:
        """Give clients the time to go that the site gives them, from the announcement on. Ends at once where
        there are none."""
        self.announce_end()
        if self._ending:
            await asyncio.gather(self._ending, return_exceptions=True)

    async def _tell_end(self, inner: InnerServer) -> None:
        settings = self._settings
        await inner.status.announce_end(
            settings.shutdown_notice_s,
            spoken(Text.of("opcua.ends")),
            lambda: any(one.holder is not None for one in inner.sessions),
            settings.return_after_s,
        )

    async def close(self) -> None:
        """Close every session and the port. May be called at any time, also twice."""
        self._pulse.stop()
        if self._ending:
            self._ending.cancel()
        registering, self._registering = self._registering, None
        if registering and self._registration:
            registering.cancel()
            await asyncio.gather(registering, return_exceptions=True)
            await self._registration.end()
        tasks = [one for one in (self._publisher, self._renewals, self._follower) if one]
        self._publisher = self._renewals = self._follower = None
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        if self._alarms:
            await self._alarms.end()
        server, self._server = self._server, None
        if server:
            await server.stop()
        bound, self._socket = self._socket, None
        if bound:
            bound.close()
        past, self._past = self._past, None
        if past:
            self._view.forget(past.on_event)
            await past.close()
        if self._users:
            self._users.close()

    # steps of start

    async def _serve(
        self, bound: socket.socket, own: ServerIdentity, trusted: ClientTrust, users: Accounts
    ) -> None:
        quieten()
        decoding.install()
        inner = self._inner_server(own)
        server = BoundServer(inner, bound, trusted)
        await self._describe(server, own.application_uri, users)
        image, epoch_ns = self._view.image, self._view.epoch_ns
        kept = self._settings.history
        rings = ValueRings(image, epoch_ns, kept)
        site = await self._fill(server, inner.aspace, layout(image.points, rings.rings, kept.black_boxes))
        tree = site.tree
        notifiers = Notifiers(tree.notifiers)
        keeper = self._keeper(EventCodec(await server.get_namespace_array()), notifiers)
        past = self._past = PlantHistory(kept, image, epoch_ns, tree, rings, keeper, self._kept / "black_box")
        await past.start()
        self._view.on_event(past.on_event)
        resets = self._settings.acknowledge_resets
        alarms = self._alarms = serve_alarms(
            inner,
            tree,
            self._view,
            self._alarm_site,
            own.certificate,
            self._kept,
            keeper,
            resets=resets,
        )
        renewal = self._renewal(own)

        def take_up(own: OwnCertificate) -> None:
            renewal.own = own
            server.renew(own.certificate, own.private_key)
            alarms.renewed(own.certificate.not_valid_after_utc, of_certificate(own.certificate))

        inner.application = Backend(
            users,
            tree.least_role,
            ReadThrough(self._view, tree.parameter),
            Writer(self._view, inner.aspace, tree.writable),
            Caller(self._view, inner.aspace, tree.method),
            ServerConfiguration(renewal, trusted.store, self._own_files, take_up),
            self._view,
            self._pulse,
            past,
        )
        server_configuration.describe(inner.aspace)
        events = EventSender(epoch_ns, inner.subscriptions, notifiers, site.event_types, keeper)
        self._view.on_event(events.on_event)
        inner.subscriptions.prepare()
        self._server, self._inner = server, inner
        await server.start()
        publisher = Publisher(image, tree.watched, events, past, ServiceLevel(image, inner.status))
        watch = RenewalWatch(self._settings, self._folder, own.application_uri)
        self._begin(publisher.run(), watch.run(take_up), alarms.run())
        if self._settings.discovery_server:
            self._register(self._settings.discovery_server, own, server.name)
        inner.garbage.begin()

    async def _fill(self, server: BoundServer, space: AddressSpace, trees: Sequence[ObjectNode]) -> SiteSpace:
        """Fill ``space`` with the models and with ``trees``."""
        models = await asyncio.to_thread(read_models)
        # The points' comes first, as it always has.
        uris = [NAMESPACE, *models.namespaces]
        indexes = {uri: await server.register_namespace(uri) for uri in uris}
        return fill(
            space,
            models,
            indexes,
            self._view.image,
            self._view.epoch_ns,
            trees,
            self._nameplates,
            keeps_events=self._settings.history.event_hours > 0,
            with_draft=self._settings.powertrain_draft,
        )

    def _inner_server(self, own: ServerIdentity) -> InnerServer:
        inner = InnerServer(no_security=self._settings.no_security)
        inner.locales = LANGUAGES
        inner.addresses = OwnAddresses(
            names_of(self._settings.listen, self._settings.names), self._settings.endpoints
        )
        inner.certificate, inner.private_key = own.certificate, own.private_key
        return inner

    def _begin(self, publishing: _Running, renewing: _Running, following: _Running) -> None:
        """Begin what runs beside the clients' requests."""
        self._publisher = asyncio.create_task(publishing, name="opcua publisher")
        self._renewals = asyncio.create_task(renewing, name="opcua renewals")
        self._follower = asyncio.create_task(following, name="opcua alarms")

    @property
    def _own_files(self) -> Path | None:
        """Folder of a certificate that is ours to replace."""
        return None if self._settings.certificate else self._folder

    def _renewal(self, own: ServerIdentity) -> OwnRenewal:
        names = names_of(self._settings.listen, reached_by(self._settings))
        return OwnRenewal(OwnCertificate(own.certificate, own.private_key), own.application_uri, names)

    def _register(self, url: str, own: ServerIdentity, name: str) -> None:
        told = RegisteredServer(
            own.application_uri,
            _PRODUCT,
            name,
            self.endpoint_url,
            own.certificate.public_bytes(Encoding.DER),
            own.private_key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption()),
        )
        self._registration = Registration(url, told)
        self._registering = asyncio.create_task(self._registration.run(), name="opcua registration")

    async def _describe(self, server: BoundServer, application_uri: str, users: Accounts) -> None:
        server.set_endpoint(self.endpoint_url)
        server.name = f"drivebridge {self._site_name}"
        server.application_type = ua.ApplicationType.Server
        server.product_uri = _PRODUCT
        server.manufacturer_name = "drivebridge"
        await server.init()
        await server.set_application_uri(application_uri)
        version = bridge.__version__
        built = await asyncio.to_thread(built_at)
        await server.set_build_info(_PRODUCT, "drivebridge", "drivebridge", version, version, built)
        server.set_security_policy(security_policies(self._settings))
        server.set_identity_tokens(users.tokens)

    def _keeper(self, codec: EventCodec, notifiers: Notifiers) -> EventKeeper | None:
        """The keeper of past events; None where none are kept."""
        kept = self._settings.history
        if not kept.event_hours:
            return None
        most_bytes = kept.events_mb * _MB
        log = EventLog(codec, notifiers, kept.event_hours, most_bytes)
        return EventKeeper(log, self._kept, most_bytes)

    def _tell(self) -> None:
        settings = self._settings
        _log.info("OPC UA on %s", self.endpoint_url)
        if settings.no_security:
            _log.warning(
                "OPC UA on %s is open: no security, anonymous clients may %s",
                self.endpoint_url,
                {"none": "not enter", "observer": "read", "operator": "read and command"}[settings.anonymous],
            )
        if settings.anonymous == "none" and not settings.user:
            _log.warning('OPC UA: nobody can log in: no [[opcua.user]] and anonymous = "none"')


def built_at() -> datetime:
    """Modification time of the newest of the program's files, UTC."""
    files = Path(bridge.__file__).parent.rglob("*.py")
    return datetime.fromtimestamp(max(file.stat().st_mtime for file in files), UTC)
