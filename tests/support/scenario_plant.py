"""The service as a process of its own, with a simulated plant, for whole days of its OPC UA clients.

Every client has two nodes on a bus of its own, so that several of them can do the same at the same time.
"""

from __future__ import annotations

import signal
import socket
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from cryptography.hazmat.primitives.serialization import Encoding

from bridge.trust import TrustStore
from tests.support import sites
from tests.support.certificates import AUTHORITY, CLIENT, DAY, NOW, Made, crl_of, make, rsa_key
from tests.support.passwords import cheap_hash
from tests.support.process import Process, free_port, peer, until

PASSWORD = "swordfish"
ROLES = {"otto": "observer", "anna": "operator", "eva": "engineer", "ida": "admin"}
"""Users with a password. carl is an operator with a certificate."""
NOTICE_S = 2
HISTORY = "[opcua.history]\nbefore_s = 5\nafter_s = 0\nblack_boxes = 2\n"
BOOT_S = 30.0


@dataclass(frozen=True)
class Plant:
    process: Process
    commands: int
    url: str

    def tell(self, *words: str) -> None:
        """Have something done to the plant: ``cut_cable can1``."""
        said = " ".join(words)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
            out.sendto(said.encode(), ("127.0.0.1", self.commands))
        until(lambda: f"done: {said}" in self.process.output(), 10, said)

    def end(self) -> None:
        """As systemd does it."""
        self.process.signal(signal.SIGTERM)


def nodes_of(bus: int, first_id: int, count: int, supervision_ms: int = 1000) -> str:
    """A bus with nodes a1, a2 … of four drives each (b1, b2 … on can1), all of them commanded by OPC UA."""
    drives = [
        sites.drive(f"fu{number}", "opcua", 0, f"{sites.ACCEPTED}\n{sites.SCALED}") for number in range(1, 5)
    ]
    names = [f"{chr(ord('a') + bus)}{number}" for number in range(1, count + 1)]
    nodes = [
        sites.node(*drives, name=name, node_id=first_id + place, more=f"supervision_ms = {supervision_ms}")
        for place, name in enumerate(names)
    ]
    return sites.bus(*nodes, name=f"can{bus}", more="bitrate = 1000000\ndeadman_ms = 1000")


def users(folder: Path) -> str:
    line = cheap_hash(PASSWORD)
    tables = [
        f'[[opcua.user]]\nname = "{name}"\nrole = "{role}"\npassword_hash = "{line}"\n'
        for name, role in ROLES.items()
    ]
    carl = f'[[opcua.user]]\nname = "carl"\nrole = "operator"\ncertificate = "{folder}/carl.der"\n'
    return "".join((*tables, carl))


def write_site(folder: Path, port: int, buses: Sequence[str]) -> Path:
    opcua = f'[opcua]\nlisten = "127.0.0.1:{port}"\nshutdown_notice_s = {NOTICE_S}\nreturn_after_s = 30\n'
    opcua += 'application_uri = "urn:plant:drivebridge"\n'
    return sites.write(folder, *buses, opcua, users(folder), HISTORY)


def lay_out(folder: Path) -> None:
    """Certificates of clients as ``folder/shown/NAME.der`` with NAME.pem, carl's beside them, and what the
    service trusts."""
    store = TrustStore(folder / "state" / "certificates")
    store.prepare()
    shown = folder / "shown"
    shown.mkdir()
    root, unknown = make(AUTHORITY), make(AUTHORITY.but(subject="unknown root", key=rsa_key(5)))
    revoked = make(CLIENT, root)
    client = {
        "trusted": make(),
        "expired": make(CLIENT.but(ends=NOW - DAY / 2)),
        "not yet valid": make(CLIENT.but(begins=NOW + DAY)),
        "wrong uri": make(CLIENT.but(uri="urn:another")),
        "weak key": make(CLIENT.but(key=rsa_key(4, 1024))),
        "wrong usage": make(CLIENT.but(usages=("data_encipherment",))),
        "no issuer": make(CLIENT, unknown),
        "revoked": revoked,
        "of authority": make(CLIENT, root),
    }
    trusted = {name: made for name, made in client.items() if made.issuer is not root}
    for name, made in {**trusted, "root": root}.items():
        (store.trusted / f"{name}.der").write_bytes(made.der)
    crl = crl_of(root, revoked).public_bytes(Encoding.DER)
    (store.trusted / "root.crl").write_bytes(crl)
    for name, made in {**client, "untrusted": make()}.items():
        _write(shown, name, made)
    person = CLIENT.but(subject="carl", uri="", usages=("digital_signature",), extended=None)
    _write(folder, "carl", make(person.but(key=rsa_key(6))))
    _write(folder, "otto", make(person.but(subject="otto")))


def _write(folder: Path, name: str, made: Made) -> None:
    (folder / f"{name}.der").write_bytes(made.der)
    (folder / f"{name}.pem").write_bytes(made.pem_key)


@contextmanager
def serving(site: Path, port: int, nodes: int, name: str = "plant") -> Iterator[Plant]:
    """``nodes`` of them are waited for."""
    commands = free_port()
    with peer(site.parent, "broken_plant", str(site), str(commands)) as process:
        process.wait_output("serving")
        until(
            lambda: process.output().count("node operational") >= nodes, BOOT_S, "the nodes are operational"
        )
        process.wait_output("OPC UA on")
        process.prefer()
        yield Plant(process, commands, f"opc.tcp://127.0.0.1:{port}/drivebridge")
