"""``nmt``: a network management command, and what the nodes do."""

from __future__ import annotations

import json
from enum import StrEnum
from typing import Annotated

import typer

from bridge.base.errors import OperationFailed
from bridge.bustools.single import NmtTask
from bridge.canopen.nmt import NmtCommand
from bridge.cli.bus_runner import AsJson, BusChoice, carry_out, choose_bus, split_site, takes_bus
from bridge.cli.terminal import progress

_USAGE = "drivebridge nmt [SITE] COMMAND NODE|all"


class CommandName(StrEnum):
    START = "start"
    STOP = "stop"
    PRE_OPERATIONAL = "pre-operational"
    RESET_NODE = "reset-node"
    RESET_COMMUNICATION = "reset-communication"


_COMMANDS = {
    CommandName.START: NmtCommand.START,
    CommandName.STOP: NmtCommand.STOP,
    CommandName.PRE_OPERATIONAL: NmtCommand.ENTER_PRE_OPERATIONAL,
    CommandName.RESET_NODE: NmtCommand.RESET_NODE,
    CommandName.RESET_COMMUNICATION: NmtCommand.RESET_COMMUNICATION,
}


@takes_bus
def nmt(
    what: Annotated[list[str], typer.Argument(metavar="[SITE] COMMAND NODE|all")],
    which: BusChoice,
    seconds: Annotated[
        float, typer.Option(min=0.05, max=60, help="how long to wait for the nodes' states")
    ] = 2.0,
    as_json: AsJson = False,
) -> None:
    """Send COMMAND (start, stop, pre-operational, reset-node, reset-communication) and say what follows.

    The state is the one that the node reports itself, by heartbeat or boot-up message.
    """
    site, (name, node) = split_site(what, 2, _USAGE)
    try:
        command = _COMMANDS[CommandName(name)]
    except ValueError:
        raise typer.BadParameter(f"{name!r} is none of {', '.join(CommandName)}") from None
    line = choose_bus(site, which)
    node_id = 0 if node == "all" else line.node_id(node)
    with progress(f"{name}: waiting up to {seconds:g} s") as show:

        def watch(task: NmtTask) -> None:
            show(0, None, f"{len(task.states)} heard, {len(task.reached)} there")

        task = carry_out(line, lambda now: NmtTask(command, node_id, now, seconds), watch)
    # The master's own heartbeat goes on; a command to all is not for the one who gives it.
    states = {n: s for n, s in sorted(task.states.items()) if n == node_id or n != line.table.master_node_id}
    stuck = [n for n in states if n not in task.reached]
    if as_json:
        nodes = [
            {"id": n, "nmt_state": state.label, "reached": n in task.reached} for n, state in states.items()
        ]
        print(json.dumps({"command": name, "node": node_id or "all", "nodes": nodes}))
    else:
        for n, state in states.items():
            print(f"node {n}: {state.label.replace('_', ' ')}")
        if not states:
            print(f"sent; nothing was heard within {seconds:g} s: no node, or one without a heartbeat")
    if stuck:
        raise OperationFailed(f"did not follow {name}: node {', '.join(map(str, stuck))}")
