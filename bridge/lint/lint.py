"""All rules over all buses of a site."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from bridge.config import Site
from bridge.eds import Description, read_device_file
from bridge.lint.bus_interface import check_interface
from bridge.lint.bus_load import BusLoad, check_load
from bridge.lint.cable import check_cable
from bridge.lint.checked_bus import Downloads, view_bus
from bridge.lint.coupler_modules import check_modules
from bridge.lint.decisions import check_decisions
from bridge.lint.identifiers import check_identifiers
from bridge.lint.intruder import Exposure, exposure
from bridge.lint.moving import check_moving
from bridge.lint.overridden_downloads import check_contradictions
from bridge.lint.own import WorstCase, check_own_supervision, worst_cases
from bridge.lint.refused_pdos import check_pdos
from bridge.lint.report import LintFinding, LintReport, Severity
from bridge.lint.silent_outputs import check_outputs, check_read_only, output_cases
from bridge.lint.times import check_times
from bridge.lint.unmapped_words import check_words
from bridge.mapping import Family
from bridge.mapping.loader import mapping_folders
from bridge.mapping.site_families import described_file, modules_of


@dataclass(frozen=True, slots=True)
class CheckResult:
    """Findings in the order of the site file, the predicted load of each bus, how long each drive may take to
    stop, and what an intruder can do on each bus."""

    findings: tuple[LintFinding, ...]
    loads: tuple[BusLoad, ...]
    worst_cases: tuple[WorstCase, ...] = ()
    exposures: tuple[Exposure, ...] = ()

    def of(self, severity: Severity) -> tuple[LintFinding, ...]:
        return tuple(finding for finding in self.findings if finding.severity is severity)


def family_dictionaries(names: Iterable[str], site: Path | None = None) -> dict[str, Description]:
    """The object dictionaries that lie beside the mapping files, or are there instead of one, by what the
    site file in ``site`` calls the mapping, for those that have one.

    Raises ``FileFaults`` where one cannot be read.
    """
    return {
        name: read_device_file(file, modules_of(name)) for name, file in dictionary_files(names, site).items()
    }


def dictionary_files(names: Iterable[str], site: Path | None = None) -> dict[str, Path]:
    """Paths of the files of ``family_dictionaries``, by the same names."""
    found: dict[str, Path] = {}
    folders = mapping_folders(site)
    for name in names:
        file = described_file(site, name) if site else None
        if file is None:
            files = (folder / f"{name}.eds" for folder in folders)
            file = next((file for file in files if file.is_file()), None)
        if file is not None:
            found[name] = file
    return found


def lint(
    site: Site,
    families: Mapping[str, Family],
    path: Path,
    downloads: Downloads,
    dictionaries: Mapping[str, Description] | None = None,
) -> CheckResult:
    """Judge a site whose file, at ``path``, has no faults of its own. ``dictionaries`` are those of
    ``family_dictionaries``, unless given."""
    known = dictionaries
    if known is None:
        known = family_dictionaries(families, path)
    report = LintReport(path)
    loads: list[BusLoad] = []
    cases: list[WorstCase] = []
    exposures: list[Exposure] = []
    for b, table in enumerate(site.bus):
        bus = view_bus(table, ("bus", b), families, known, downloads)
        check_interface(bus, report)
        check_identifiers(bus, report)
        check_pdos(bus, report)
        check_words(bus, report)
        check_times(bus, report)
        check_own_supervision(bus, report)
        check_contradictions(bus, report)
        check_outputs(bus, report)
        check_read_only(bus, report)
        check_moving(bus, report)
        check_modules(bus, known, report)
        check_cable(bus, report)
        cases += [*worst_cases(bus), *output_cases(bus)]
        loads.append(check_load(bus, report))
        exposures.append(exposure(bus))
    check_decisions(site, families, report)
    return CheckResult(report.findings(), tuple(loads), tuple(cases), tuple(exposures))
