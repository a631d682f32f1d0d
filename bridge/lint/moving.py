"""Check for downloads of the boot-up that move something without an owner."""

from __future__ import annotations

from bridge.lint.checked_bus import CheckedBus
from bridge.lint.report import LintReport
from bridge.mapping.entry_types import ObjectRef
from bridge.parameter import Names
from bridge.parameter.write_effect import Effect
from bridge.text import Text


def check_moving(bus: CheckedBus, report: LintReport) -> None:
    """Report downloads to objects that command a node; 0 is allowed, their value after switching on."""
    for node in bus.nodes:
        names = Names(node.family)
        for (index, sub), value in node.settings.values.items():
            address = ObjectRef(index, sub)
            setting = node.settings[index, sub]
            if not value or setting is None or names.protection.effect(address) is not Effect.COMMANDS:
                continue
            report.error(
                setting.key,
                Text.of("check.moves", parameter=names.at(address).name, node=node.table.name, value=value),
                Text.of("check.moves_advice"),
            )
