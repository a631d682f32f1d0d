"""``certificates``: whom the service trusts, and its own. On the folders, also while the service runs."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any

import typer
from cryptography import x509

from bridge.base.errors import OperationFailed
from bridge.cli.bus_runner import AsJson, print_table
from bridge.cli.terminal import printable
from bridge.config import OpcUaTable, Site
from bridge.northbound.opcua.certificates.client_trust import client_store
from bridge.northbound.opcua.certificates.own_certificate import reason
from bridge.northbound.opcua.certificates.own_files import CERTIFICATE, own_folder
from bridge.northbound.opcua.certificates.server_identity import renew as renewed
from bridge.project import load_project
from bridge.text import Text, render
from bridge.trust import TrustStore
from bridge.trust.files import MALFORMED, fingerprint, parse, read_limited, thumbprint
from bridge.trust.inventory import Listed, inventory

app = typer.Typer(help="Certificates that the service trusts, and its own.", no_args_is_help=True)

SiteArgument = Annotated[Path, typer.Argument(metavar="SITE", help="the site file")]
_COLUMNS = ("place", "thumbprint", "until", "subject", "what is wrong")


@app.command("list")
def list_(site: SiteArgument, as_json: AsJson = False) -> None:
    """List the certificates: own, trusted, issuers, and those that were refused, with the reason."""
    _, store = _opened(site)
    found = list(inventory(store, datetime.now(UTC)))
    if as_json:
        print(json.dumps([_facts(one) for one in found], indent=2))
        return
    print_table([_COLUMNS, *(_row(one) for one in found)])


@app.command()
def trust(
    site: SiteArgument,
    certificate: Annotated[
        str, typer.Argument(metavar="CERTIFICATE", help="a thumbprint out of the list, or a file")
    ],
) -> None:
    """Trust a client that was refused, or whose certificate is in a file."""
    _, store = _opened(site)
    file = Path(certificate)
    chosen = _in_file(file) if file.is_file() else store.find_rejected(certificate).certificate
    store.trust(chosen)
    print(printable(f"trusted: {thumbprint(chosen)}, {chosen.subject.rfc4514_string()}"))


@app.command()
def reject(
    site: SiteArgument,
    thumbprint: Annotated[str, typer.Argument(metavar="THUMBPRINT", help="of one that is trusted")],
) -> None:
    """Trust a client no more."""
    _, store = _opened(site)
    path = store.reject(store.find_trusted(thumbprint))
    print(printable(f"rejected: {path.stem}"))


@app.command()
def renew(
    site: SiteArgument,
    new_key: Annotated[bool, typer.Option("--new-key", help="with a new key, too")] = False,
) -> None:
    """Make a new certificate for the bridge, which clients have to trust anew."""
    found, _ = _opened(site)
    settings = found.opcua or OpcUaTable.model_validate({})
    if settings.certificate:
        raise OperationFailed(Text.of("certificate.named_by_site", file=settings.certificate))
    folder = own_folder(Path(found.site.state_dir))
    if not (folder / CERTIFICATE).exists():
        raise OperationFailed(Text.of("certificate.none_yet", folder=str(folder)))
    try:
        own = renewed(settings, folder, new_key=new_key)
    except OSError as error:
        said = Text.of("trust.unwritable", file=str(error.filename or folder), why=reason(error))
        raise OperationFailed(said) from error
    day = f"{own.certificate.not_valid_after_utc:%Y-%m-%d}"
    print(f"{folder / CERTIFICATE}: valid until {day}, SHA-256 {fingerprint(own.certificate)}")


def _opened(path: Path) -> tuple[Site, TrustStore]:
    site = load_project(path).site
    return site, client_store(site.opcua or OpcUaTable.model_validate({}), Path(site.site.state_dir))


def _in_file(file: Path) -> x509.Certificate:
    """Raises ``OperationFailed`` for a file without a certificate."""
    try:
        found = parse(read_limited(file))
    except (OSError, *MALFORMED) as error:
        raise OperationFailed(Text.of("trust.unusable_file", file=str(file), why=str(error))) from error
    if not isinstance(found, x509.Certificate):
        raise OperationFailed(Text.of("trust.unusable_file", file=str(file), why="a revocation list"))
    return found


def _row(one: Listed) -> tuple[str, ...]:
    wrong = f"{one.fault}: {render(one.said)}" if one.fault else ""
    return one.place, one.thumbprint, f"{one.until:%Y-%m-%d}", one.subject, wrong


def _facts(one: Listed) -> dict[str, Any]:
    return {
        "place": one.place,
        "thumbprint": one.thumbprint,
        "fingerprint": one.fingerprint,
        "subject": one.subject,
        "since": one.since.isoformat(),
        "until": one.until.isoformat(),
        "fault": one.fault or None,
        "reason": render(one.said),
        "file": str(one.file),
    }
