"""Check for couplers whose modules are not named."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from bridge.eds import Description
from bridge.lint.checked_bus import CheckedBus
from bridge.lint.report import LintReport
from bridge.text import Text

_SHOWN: Final = 3


def check_modules(bus: CheckedBus, dictionaries: Mapping[str, Description], report: LintReport) -> None:
    for node in bus.nodes:
        known = dictionaries.get(node.table.mapping_key)
        if known is None or not known.modules or known.plugged:
            continue
        names = [one.order_code or one.product or str(one.number) for one in known.modules[:_SHOWN]]
        listed = ", ".join(f'"{name}"' for name in names)
        more = ", …" if len(known.modules) > _SHOWN else ""
        report.warning(
            (*node.key, "mapping"),
            Text.of("check.modules_not_named", count=len(known.modules)),
            Text.of("check.modules_advice", names=listed + more),
        )
