"""``family``: make a mapping file of a device description."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Final

import typer

from bridge.base.errors import FileFaults, OperationFailed
from bridge.cli.terminal import printable
from bridge.derive import derive_family
from bridge.eds import FindingSeverity, contradictions, read_whole_device_file
from bridge.mapping.loader import mappings_dir, read_family
from bridge.mapping.model import Family, Parameter

app = typer.Typer(help="Mapping files of drive families.", no_args_is_help=True)

_FOLDER: Final = Path("mappings")


@app.callback()
def _group() -> None:  # pyright: ignore[reportUnusedFunction]
    """Without it a single command would have no name."""


@app.command()
def new(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="an EDS, DCF, XDD or XDC")],
    mode: Annotated[
        str | None, typer.Option(help="the mode of operation, such as velocity; left out, the best known")
    ] = None,
    output: Annotated[
        Path | None, typer.Option(help="where to write it; left out, mappings/VENDOR/PRODUCT.toml")
    ] = None,
    module: Annotated[
        list[str] | None,
        typer.Option(help="a module that is plugged in, by order code, name or number; in their order"),
    ] = None,
) -> None:
    """Write a mapping for the device that FILE describes: a drive with CiA 402, or one that is no drive."""
    description = read_whole_device_file(file, module or ())
    lost = [one for one in description.findings if one.severity is FindingSeverity.ERROR]
    told = sorted((*lost, *contradictions(description)), key=lambda one: one.line)
    derived = derive_family(description, file.name, mode)
    path = output or _FOLDER / f"{derived.name}.toml"
    family = _written(path, derived.text)
    print(printable(f"{path}: {family.family.name}, {derived.base}, {_count(family.parameter)}"))
    if derived.read_only:
        print(printable(f"{file}: only read: {derived.read_only}"))
    for one in told:
        print(printable(f"{file}:{one.line}: {one.said}"))


def _written(path: Path, text: str) -> Family:
    """The mapping at ``path``, which is there whole and readable, or not at all. Raises ``OperationFailed``
    and ``FileFaults``."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        out = path.open("x", encoding="utf-8")
    except FileExistsError:
        raise OperationFailed(f"{path} is there already") from None
    except OSError as error:
        raise OperationFailed(f"{path} cannot be written: {error.strerror}") from error
    try:
        with out:
            out.write(text)
        return read_family(path, (_FOLDER, mappings_dir()))
    except OSError as error:
        path.unlink(missing_ok=True)
        raise OperationFailed(f"{path} cannot be written: {error.strerror}") from error
    except FileFaults:
        path.unlink(missing_ok=True)
        raise


def _count(parameters: list[Parameter]) -> str:
    return f"{len(parameters)} parameters"
