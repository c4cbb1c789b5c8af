"""The modules of one robot: saved, listed and deleted as the manual's table allows, and provided to their callers.

Knows the calls between modules; runs nothing.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Collection, Iterable
from dataclasses import replace

from roboglot.programs.errors import (
    CannotExecute,
    InvalidCondition,
    LimitReached,
    ModuleGone,
    NotAllowed,
    RecursiveModule,
)
from roboglot.programs.library.inspection import Inspector, refuse_wrong
from roboglot.programs.library.modules import ModuleOperation, ModuleState, function_of, in_the_body, next_module_state
from roboglot.programs.stores import ListedProgram, ProgramStore, StoredProgram
from roboglot.programs.tasks.states import TaskOperation
from roboglot.task_conditions import BadCondition, parse_interface
from roboglot.values import dataclass

MODULES_MAX = 1000


@dataclass(frozen=True, slots=True)
class _Known:
    """A module's interface name, its state, and the ids of the modules that it calls."""

    name: str
    state: ModuleState
    uses: frozenset[str]


class ModuleLibrary:
    """Store of modules. ``lock``: shared with the tasks, whose modules must not vanish during a change.

    ``allow`` raises ProgramError if the robot's mode forbids an operation.
    """

    def __init__(
        self,
        store: ProgramStore,
        inspector: Inspector,
        lock: asyncio.Lock,
        allow: Callable[[TaskOperation], None],
    ) -> None:
        self._store = store
        self._inspector = inspector
        self._lock = lock
        self._allow = allow
        self._known = {
            id: _Known(parse_interface(condition).name, ModuleState(state), uses)
            for id, condition, state, uses in store.names_now()
        }

    @property
    def functions(self) -> frozenset[str]:
        """Names under which modules are called, including those of modules with problems."""
        return frozenset(module.name for module in self._known.values())

    def ids(self, names: Iterable[str]) -> frozenset[str]:
        """Return the ids of the modules with these names. Raises ProgramError if one is gone."""
        by_name = {module.name: id for id, module in self._known.items()}
        try:
            return frozenset(by_name[name] for name in names)
        except KeyError as gone:
            raise ModuleGone(f"the module {gone} was deleted just now") from None

    async def modules(self, ids: Collection[str] = ()) -> list[ListedProgram]:
        """Return the modules with these ``ids`` that exist, or all of them, by id."""
        self._allow(TaskOperation.INQUIRY)
        return await self._store.all(ids)

    async def get(self, id: str) -> StoredProgram | None:
        """Return a module with its body."""
        return await self._store.get(id)

    async def save(self, module: StoredProgram) -> None:
        """Add or replace a module; ``state`` is ignored. One with problems is stored, too, but raises ProgramError."""
        self._allow(TaskOperation.SAVE)
        try:
            interface = parse_interface(module.condition)
        except BadCondition as error:
            raise InvalidCondition(f"condition: {error}") from None
        self._check_name(module.id, interface.name)
        others = self.functions - {interface.name}
        found, names = await self._inspector.inspect(function_of(interface, module.body), others)
        problems = [in_the_body(problem) for problem in found]
        async with self._lock:
            self._check_name(module.id, interface.name)
            uses = self.ids(names)
            self._check_loop(module.id, uses)
            before = self._state(module.id)
            if before is ModuleState.NULL and len(self._known) >= MODULES_MAX:
                raise LimitReached(f"{MODULES_MAX} modules are stored already")
            after = next_module_state(before, ModuleOperation.SAVE, correct=not problems)
            assert after is not None, "saving is legal in every state"
            await self._store.put(replace(module, state=after), uses)
            self._known[module.id] = _Known(interface.name, after, uses)
        refuse_wrong(problems)

    async def delete(self, id: str) -> None:
        """Delete a module. Raises NotAllowed if it is called by a task or module."""
        self._allow(TaskOperation.DELETE)
        async with self._lock:
            before = self._state(id)
            callers = await self._store.used_by(id)
            after = next_module_state(before, ModuleOperation.DELETE, used=bool(callers))
            if after is None:
                raise NotAllowed(f"The current operation(delete) is illegal: {id} is in {before}.")
            if callers:
                shown = ", ".join(callers[:10]) + (" …" if len(callers) > 10 else "")
                raise NotAllowed(f"the module {id} is called by {shown}")
            await self._store.remove(id)
            del self._known[id]

    async def sources(self, ids: Iterable[str]) -> dict[str, str]:
        """Return the functions of these modules and all that they call. Raises CannotExecute for one in error."""
        sources: dict[str, str] = {}
        for id in sorted(self._reach(ids)):
            module = await self._store.get(id)
            if module is None or self._state(id) is not ModuleState.NORMAL:
                name = self._known[id].name if id in self._known else id
                raise CannotExecute(f"the module {name} ({id}) that it calls has errors")
            interface = parse_interface(module.condition)
            sources[interface.name] = function_of(interface, module.body)
        return sources

    def _state(self, id: str) -> ModuleState:
        known = self._known.get(id)
        return known.state if known else ModuleState.NULL

    def _check_name(self, id: str, name: str) -> None:
        """Raise InvalidCondition if the name is taken, or differs from the earlier one that callers use."""
        own = self._known.get(id)
        if own is not None and own.name != name:
            raise InvalidCondition(
                f"condition: the interface of {id} is called {own.name}, and that cannot change",
            )
        taken = next((other for other, module in self._known.items() if module.name == name and other != id), None)
        if taken is not None:
            raise InvalidCondition(f"condition: the module {taken} is called {name} already")
        if self._inspector.reserved(name):
            raise InvalidCondition(f"condition: {name} means something in the language already")

    def _check_loop(self, id: str, uses: frozenset[str]) -> None:
        if id in self._reach(uses):
            raise RecursiveModule(f"the module {id} would call itself through others")

    def _reach(self, ids: Iterable[str]) -> set[str]:
        """Return these modules and all that they call."""
        reached: set[str] = set()
        open_ends = list(ids)
        while open_ends:
            id = open_ends.pop()
            if id not in reached:
                reached.add(id)
                known = self._known.get(id)
                open_ends += known.uses if known else ()
        return reached
