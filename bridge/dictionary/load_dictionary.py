"""canopen's object dictionary by the name of a family, a mapping file or a device description."""

from __future__ import annotations

from collections.abc import Sequence
from io import StringIO
from pathlib import Path

from canopen import ObjectDictionary
from canopen.objectdictionary.eds import export_eds  # pyright: ignore[reportUnknownVariableType]

from bridge.dictionary.family_objects import add_family
from bridge.dictionary.object_dictionary import dictionary_of
from bridge.eds import Description, read_whole_device_file
from bridge.mapping.loader import load_family, mapping_folders, read_family
from bridge.tomlfile import TomlFile


def load_dictionary(
    what: str | Path, node_id: int | None = None, folders: Sequence[Path] = ()
) -> ObjectDictionary:
    """The object dictionary of a family (``nord/sk-tu4-cao``), a mapping file, an EDS, DCF, XDD or XDC.

    A family's parameters are put over the EDS that lies beside its mapping, or beside one that it extends.
    ``folders`` are where mappings are looked up, by default the program's own. Raises ``FileFaults``.
    """
    folders = folders or mapping_folders()
    path = Path(what)
    if path.suffix == ".toml":
        family, eds = read_family(path, folders), _eds_of(path, folders)
    elif path.suffix or path.is_file():
        return dictionary_of(read_whole_device_file(path), node_id)
    else:
        family = load_family(str(what), folders)
        own = next(file for folder in folders if (file := folder / f"{what}.toml").is_file())
        eds = _eds_of(own, folders)
    description = read_whole_device_file(eds) if eds else Description("EDS")
    dictionary = dictionary_of(description, node_id)
    add_family(dictionary, family)
    return dictionary


def as_eds(dictionary: ObjectDictionary) -> str:
    """``dictionary`` as the EDS that ``canopen.import_od`` reads, with its keys Factor, Unit and Description,
    which CiA 306 does not have. Bits and the texts of single values have no place in it."""
    text = StringIO()
    export_eds(dictionary, text, file_info={})
    return text.getvalue()


def _eds_of(mapping: Path, folders: Sequence[Path]) -> Path | None:
    """The EDS beside a mapping file, or beside the nearest that it extends; None where there is none."""
    place: Path | None = mapping
    while place is not None:
        eds = place.with_suffix(".eds")
        if eds.is_file():
            return eds
        base = TomlFile(place).root.content.get("extends")
        places = (folder / f"{base}.toml" for folder in folders)
        place = next((file for file in places if file.is_file()), None) if base else None
    return None
