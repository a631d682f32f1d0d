"""``record``: what the flight recorder of a service has, as a file."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer

from bridge.base.errors import OperationFailed
from bridge.cli.bus_runner import tell
from bridge.cli.recording_file import SUFFIXES, write_as
from bridge.config import load_site
from bridge.recorder.recording import SUFFIX, read
from bridge.recorder.ring import parts_of, segments_in, write_recording


def record(
    source: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="the site file of a service, or a recording"),
    ],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help=f"the file to write; its suffix says how: {', '.join(SUFFIXES)}"),
    ] = None,
) -> None:
    """Write the latest that the recorder of a service has, or a recording in another format."""
    target = output or Path(f"{source.stem}-{datetime.now(tz=UTC):%Y%m%dT%H%M%SZ}{SUFFIX}")
    if target.suffix not in SUFFIXES:
        raise typer.BadParameter(f"{target}: a suffix is {', '.join(SUFFIXES)}")
    if source.suffix == SUFFIX:
        if target.suffix == SUFFIX:
            raise typer.BadParameter(f"{source} is a recording already: --output with another suffix")
        _convert(source, target)
        return
    _write_ring(source, target)


def _write_ring(site_file: Path, target: Path) -> None:
    """Write what is in the ring of the site's service to ``target``."""
    folder = Path(load_site(site_file).site.state_dir) / "recorder"
    whole = target if target.suffix == SUFFIX else target.with_name(f".{target.name}{SUFFIX}")
    try:
        parts = parts_of(folder, segments_in(folder))
        if not parts:
            raise OperationFailed(f"{folder} has no recording: is the service running, with its recorder on?")
        write_recording(parts, whole)
    except OSError as error:
        raise OperationFailed(f"{error.filename or target}: {error.strerror}") from None
    if whole is target:
        tell(f"{target}: {target.stat().st_size / 1e6:.1f} MB")
        return
    try:
        _convert(whole, target)
    finally:
        whole.unlink()


def _convert(recording: Path, target: Path) -> None:
    number = write_as(read(recording), target)
    tell(f"{target}: {number} {'lines' if target.suffix == '.jsonl' else 'frames'}")
