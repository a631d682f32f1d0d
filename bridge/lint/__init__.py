"""What is wrong or doubtful about a site as a whole, before anything is on the bus.

A site file is checked by ``bridge.config`` key by key; here it is seen together with its mappings: who
uses which COB-ID, how full the bus gets, which times cannot work together.
"""

from bridge.lint.lint import Verdict, family_dictionaries, lint
from bridge.lint.load import BusLoad
from bridge.lint.own import WorstCase
from bridge.lint.report import LintFinding, Severity

__all__ = [
    "BusLoad",
    "LintFinding",
    "Severity",
    "Verdict",
    "WorstCase",
    "family_dictionaries",
    "lint",
]
