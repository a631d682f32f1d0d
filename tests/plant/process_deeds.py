"""What happens to the processes of a bridge: they stand still, and end."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tests.plant.plan import Step

if TYPE_CHECKING:
    from tests.plant.plant import Plant


def hang(plant: Plant, step: Step) -> None:
    """The bus process stands still: between two turns, or in one, of a round or of a controller's telegram,
    at the look at the clock of number ``which``."""

    def begin() -> None:
        in_turn = step.how != "between turns"
        plant.bridge.process.hang(step.seconds, in_turn=in_turn, skips=step.which)

    match step.how:
        case "in a round":
            plant.bridge.before_round = begin
        case "in a telegram":
            plant.before_telegram = begin
        case _:
            begin()


def kill(plant: Plant, step: Step) -> None:
    """The bus process is killed, and comes back after some seconds."""
    if not plant.bridge.process.is_dead:
        plant.down_s = step.seconds
        plant.bridge.process.kill(in_turn=step.how == "in a turn")


def hang_front(plant: Plant, step: Step) -> None:
    plant.front.process.hang(step.seconds, in_turn=step.how == "in a turn")


def kill_front(plant: Plant, step: Step) -> None:
    process = plant.front.process
    if not process.is_dead:
        process.kill(in_turn=False)
        plant.world.after(step.seconds, plant.front.start)
