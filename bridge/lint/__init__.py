"""Faults and doubts of a site as a whole, found before anything is on the bus.

A site file is checked by ``bridge.config`` key by key; here it is seen together with its mappings: who
uses which COB-ID, how full the bus gets, which times cannot work together.
"""

from bridge.lint.lint import CheckResult as CheckResult
from bridge.lint.lint import dictionary_files as dictionary_files
from bridge.lint.lint import family_dictionaries as family_dictionaries
from bridge.lint.lint import lint as lint
from bridge.lint.own import WorstCase as WorstCase
from bridge.lint.report import Severity as Severity
