"""A front of a plant: the mirror's end in a process of its own, and what the clients of its server ask."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from math import inf
from typing import Final, cast

from bridge.command import Event, EventKind, Identity, Outcome, Request, Write
from bridge.command.messages.freshness import Inflow
from bridge.image import Image, Quality
from bridge.mirror import MirrorClient
from bridge.northbound.pulse import Pulse
from bridge.zenohlink import ZenohLink
from tests.plant.answers import Answers
from tests.plant.bridge_process import Bridge
from tests.plant.machine import Process
from tests.plant.meeting import Link, Meeting
from tests.plant.world import World

_SIGN_S, _BACK_S = 5.0, 0.5
"""After so long without a sign of life a front is killed (docs: "Fronts"), and so soon a new one begins."""
_JUST_S: Final = 0.25
"""A front that has just gone on has not looked whether the bus process is there."""


class _Mirror(MirrorClient):
    """The real one, over the plant's socket."""

    def __init__(self, link: Callable[[], Link], world: World, clock: Callable[[], float], name: str) -> None:
        self._link_of_plant = link
        super().__init__("", clock, name, lambda: world.epoch_ns(clock()) / 1e9)

    def _new_link(self) -> ZenohLink:
        return cast("ZenohLink", self._link_of_plant())


class Front:
    """The front called ``name``. ``start`` begins a new process; what listens to it stays."""

    def __init__(self, world: World, meeting: Meeting, name: str, faults: list[str]) -> None:
        """``faults`` gets what fails in its processes."""
        self.world = world
        self._meeting = meeting
        self.name = name
        self._faults = faults
        self._links: list[Link] = []
        self._requests = 0
        self.on_start: list[Callable[[], None]] = []
        """Called when its server is open."""
        self.on_request: list[Callable[[int, Request], None]] = []
        """Called with each request that comes, and its number; ``on_answer`` with its outcome."""
        self.on_answer: list[Callable[[int, Request, Outcome], None]] = []
        self.on_lost: list[Callable[[int], None]] = []
        """Called with the number of a request that nobody answers any more."""
        self.on_disturbed: list[Callable[[], None]] = []
        """Called when it stands still, goes on, or ends."""
        self._waiting: dict[int, Request] = {}
        self._went_on_at = -inf
        self.start()

    # life

    def start(self) -> None:
        process = self.process = Process(self.world, self, self._faults)
        self._is_open = False
        self._inflows: dict[str, Inflow] = {}
        self._pulse = Pulse(process.clock)
        self._mirror = _Mirror(self._link, self.world, process.clock, self.name)
        self.world.after(0.0, lambda: process.post(self._begin))

    def _begin(self) -> None:
        self.process.loop.create_task(self._run())

    def end(self) -> None:
        """Nothing of it is left."""
        self.process.kill(in_turn=False)

    def _link(self) -> Link:
        link = self._meeting.link(self.process)
        self._links.append(link)
        return link

    async def _run(self) -> None:
        await self._mirror.open()
        self._pulse.start()
        self._is_open = True
        for tell in self.on_start:
            tell()
        await self._mirror.run()

    def on_still(self, now: float) -> None:
        """Its clients wait, and who looks after it."""
        self._tell_disturbed()
        self.world.after(_SIGN_S, partial(self._look_for_sign, self.process, now))

    def _tell_disturbed(self) -> None:
        for tell in self.on_disturbed:
            tell()

    def _look_for_sign(self, process: Process, since: float) -> None:
        if process.still_since == since and not process.is_dead:
            process.kill(in_turn=False)
            self.world.after(_BACK_S, self.start)

    def on_going_on(self, since: float, now: float) -> None:
        self._went_on_at = now
        self._tell_disturbed()

    def on_end(self, now: float) -> None:
        """The kernel closes what the process had open, its clients' connections too."""
        self._is_open = False
        self._tell_disturbed()
        links, self._links = self._links, []
        for link in links:
            link.drop()
        waiting, self._waiting = self._waiting, {}
        for number in waiting:
            for tell in self.on_lost:
                tell(number)

    # who asks

    def ask(
        self,
        request: Request,
        delay_s: float,
        arrived: Callable[[], None],
        reply: Callable[[Outcome], None],
    ) -> None:
        """A request of one of its clients. ``reply`` is called when the outcome is given."""

        def arrive() -> None:
            if not self._is_open:
                return
            arrived()
            self._requests += 1
            number = self._requests
            self._waiting[number] = request
            for tell in self.on_request:
                tell(number, request)
            self.process.post(lambda: self._serve(number, request, reply))

        self.world.after(delay_s, arrive)

    def _serve(self, number: int, request: Request, reply: Callable[[Outcome], None]) -> None:
        now, look = self.process.clock(), self._pulse.look
        client = request.identity.connection
        inflow = self._inflows.get(client)
        if inflow is None:
            inflow = self._inflows[client] = Inflow(now, look)
        came = replace(request, received_at=inflow.arrive(now, look))
        self._mirror.submit(came, partial(self._answer, number, request, reply))

    def _answer(
        self, number: int, request: Request, reply: Callable[[Outcome], None], outcome: Outcome
    ) -> None:
        self._waiting.pop(number, None)
        for tell in self.on_answer:
            tell(number, request, outcome)
        reply(outcome)

    def connected(self, identity: Identity, *, is_there: bool) -> None:
        self._inflows.pop(identity.connection, None)
        if self._is_open:
            self.process.post(lambda: self._mirror.on_connection(identity, is_there=is_there))

    # what its clients read

    @property
    def image(self) -> Image | None:
        """As its clients see it; None while nobody sees any, or a front that went on has not looked yet."""
        process = self.process
        is_looked_at = process.still_since == inf and self.world.now > self._went_on_at + _JUST_S
        return self._mirror.image if self._is_open and is_looked_at else None

    def good_number(self, name: str) -> float | None:
        """Value of a point that is a number, and good."""
        image = self.image
        if image is None:
            return None
        reading = image.read(name)
        is_number = reading.quality is Quality.GOOD and isinstance(reading.value, int | float)
        return reading.value if is_number else None  # type: ignore[return-value]


def judge_front(front: Front, bridge: Bridge, answers: Answers) -> None:
    """Have ``answers`` look at what a front answers and shows, and at the refusals of its clients' requests
    that ``bridge`` tells."""
    world, name = front.world, front.name

    def on_answer(number: int, asked: Request, outcome: Outcome) -> None:
        world.tell(f"request {number} of {name} {outcome.code} {outcome.forwarded}")
        answers.answered((name, number), outcome, world.now)
        point = f"{asked.target}/command/control_word"
        if outcome.ok and isinstance(asked.command, Write):
            shown = front.good_number(point), bridge.good_number(point)
            answers.shown(asked.target, asked.command.values["control_word"], *shown, world.now)

    def on_event(event: Event) -> None:
        if event.kind is EventKind.REFUSED and f" by {name}:controller " in event.message:
            answers.refusal_told(event.source, world.now)

    front.on_request.append(lambda number, asked: answers.asked((name, number), asked, world.now))
    front.on_answer.append(on_answer)
    front.on_lost.append(lambda number: answers.lost((name, number)))
    front.on_disturbed.append(lambda: answers.front_disturbed(world.now))
    bridge.on_event.append(on_event)
