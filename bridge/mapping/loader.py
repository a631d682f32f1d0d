"""Finding and reading drive-family files."""

from __future__ import annotations

from pathlib import Path

from bridge.errors import Fault, FileFaults
from bridge.mapping.model import Family
from bridge.tomlfile import TomlFile


def mappings_dir() -> Path:
    """The folder of the families: inside the installed package, or at the top of a checkout."""
    package = Path(__file__).resolve().parents[1]
    installed = package / "families"
    return installed if installed.is_dir() else package.parent / "mappings"


def family_names() -> list[str]:
    """Every family that is there, as the site file names them."""
    top = mappings_dir()
    return sorted(str(file.relative_to(top).with_suffix("")) for file in top.rglob("*.toml"))


def load_family(name: str) -> Family:
    """The family called ``name`` (``nord/sk-tu4-cao``). Raises ``FileFaults`` with every fault in it."""
    path = mappings_dir() / f"{name}.toml"
    if not path.is_file():
        known = ", ".join(family_names())
        raise FileFaults([Fault(str(path), 0, "", f"there is no mapping {name!r}", f"there are: {known}")])
    return read_family(path)


def read_family(path: Path) -> Family:
    """Read and check one mapping file."""
    file = TomlFile(path)
    family = file.validate(Family)
    if family is not None:
        _check_slots(family, file)
        _check_values(family, file)
        _check_words(family, file)
    file.finish()
    if family is None:
        raise AssertionError("a mapping file without a model always has faults")
    return family


def _check_slots(family: Family, file: TomlFile) -> None:
    seen: set[str] = set()
    for s, slot in enumerate(family.slot):
        if slot.name in seen:
            file.fault(("slot", s, "name"), f"slot {slot.name!r} is there twice")
        seen.add(slot.name)
        for pdo_name, pdo, words in (
            ("rpdo", slot.rpdo, family.process.rpdo),
            ("tpdo", slot.tpdo, family.process.tpdo),
        ):
            if len(pdo.objects) != len(words):
                file.fault(
                    ("slot", s, pdo_name, "objects"),
                    f"has {len(pdo.objects)} words and process.{pdo_name} names {len(words)}",
                )
        if slot.emcy_drive is not None and family.emcy.drive_byte is None:
            file.fault(("slot", s, "emcy_drive"), "has no meaning without emcy.drive_byte")


def _check_values(family: Family, file: TomlFile) -> None:
    parameters = {parameter.name for parameter in family.parameter}
    for v, value in enumerate(family.value):
        words = family.process.rpdo if value.group == "command" else family.process.tpdo
        if value.word not in words:
            file.fault(("value", v, "word"), f"there is no word {value.word!r}", f"known: {', '.join(words)}")
        if value.scale.full not in parameters:
            known = ", ".join(sorted(parameters))
            file.fault(
                ("value", v, "scale"), f"there is no parameter {value.scale.full!r}", f"known: {known}"
            )


def _check_words(family: Family, file: TomlFile) -> None:
    if family.process.rpdo[0] != "control_word":
        file.fault(("process", "rpdo"), "must begin with control_word")
    if family.process.tpdo[0] != "status_word":
        file.fault(("process", "tpdo"), "must begin with status_word")
    control = family.control_word
    enabling = control.enabling
    if enabling.value & ~enabling.mask:
        file.fault(("control_word", "enabling"), "value has bits outside its mask")
    for name, word in (("stopped", control.stopped), ("ready", control.ready)):
        if word & enabling.mask == enabling.value:
            file.fault(("control_word", name), f"{word:04X}h would enable the drive")
        if control.valid_bit is not None and not word >> control.valid_bit & 1:
            file.fault(("control_word", name), f"{word:04X}h is not valid: bit {control.valid_bit} is 0")
    for name in ("stop", "quick_stop", "disable_voltage"):
        command = getattr(control, name)
        if (control.run & ~command.mask | command.value) & enabling.mask == enabling.value:
            file.fault(("control_word", name), "leaves the drive enabled")
