"""Switches of the events on the event port (manual 3.2.6.3, 3.2.7.1, 3.2.10.4), and their text."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from roboglot.model.components.interaction.armor import Armor
from roboglot.model.components.sensing.adapter import SensorAdapters
from roboglot.model.components.sensing.hearing import Hearing
from roboglot.model.events import AdapterLevelChanged, ArmorHit
from roboglot.model.feed import Viewer
from roboglot.model.perception import ClapsHeard
from roboglot.protocols.robomaster.context import Context
from roboglot.protocols.robomaster.vocabulary import ARMOR, HITS

CLAPS_MIN = 2  # one bang is not applause


class EventSwitches:
    """Switches, off by default; each one listens only while it is on. Idempotent."""

    def __init__(self, context: Context) -> None:
        self._context, self._robot = context, context.robot
        self._stops: dict[str, Callable[[], object]] = {}

    def armor(self, on: bool) -> None:
        """Switch ``armor event hit``: plate and cause."""
        self._robot.require(Armor)
        self._switch("armor", on, lambda: self._robot.events.listen(ArmorHit, self._on_hit))

    def adapters(self, on: bool) -> None:
        """Switch ``sensor_adapter event io_level``: changed level of an input."""
        self._robot.require(SensorAdapters)
        self._switch("adapters", on, lambda: self._robot.events.listen(AdapterLevelChanged, self._on_level))

    def applause(self, on: bool) -> None:
        """Switch ``sound event applause``: number of claps in a row."""
        self._robot.require(Hearing)
        self._switch("applause", on, self._listen)

    def reset(self) -> None:
        """Switch all off."""
        for name in tuple(self._stops):
            self._stops.pop(name)()

    def _switch(self, name: str, on: bool, begin: Callable[[], Callable[[], object]]) -> None:
        if on and name not in self._stops:
            self._stops[name] = begin()
        elif not on and name in self._stops:
            self._stops.pop(name)()

    def _send(self, text: str) -> None:
        self._context.outlets.send_event(self._context.profile.event(text))

    def _on_hit(self, hit: ArmorHit) -> None:
        self._send(f"armor event hit {ARMOR[hit.place]} {HITS[hit.kind]}")

    def _on_level(self, change: AdapterLevelChanged) -> None:
        self._send(f"sensor_adapter event io_level ({change.adapter}, {change.port}, {int(change.level)})")

    def _listen(self) -> Callable[[], object]:
        runs = self._robot[Hearing].claps()  # now, so that this request is refused if a real robot refuses
        task = asyncio.get_running_loop().create_task(self._applaud(runs), name="sound event")

        def stop() -> None:
            task.cancel()
            runs.close()

        return stop

    async def _applaud(self, runs: Viewer[ClapsHeard]) -> None:
        with runs:
            async for heard in runs:
                if heard.count >= CLAPS_MIN:
                    self._send(f"sound event applause {heard.count}")
