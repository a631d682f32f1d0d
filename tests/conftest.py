"""What holds for all tests: none leaves a task, a thread, a process or a socket behind."""

from __future__ import annotations

from tests.support.leaks import leaves_nothing, module_leaves_nothing

__all__ = ["leaves_nothing", "module_leaves_nothing"]
