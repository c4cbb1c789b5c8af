"""The book of templates and calls. It drives nowhere: clients carry out calls and report their outcome."""

from __future__ import annotations

import uuid
from collections.abc import Sequence
from dataclasses import replace

import msgspec

from roboglot.autonomy.delivery.rules import place_named
from roboglot.model.components.logistics.delivery import OrderStatus
from roboglot.model.components.logistics.industry import Call, CallKind, Industry, RoundTemplate
from roboglot.model.components.system.ledger import Ledger
from roboglot.model.errors import InvalidGoal, NotFound, Refused
from roboglot.model.robot import Robot

TEMPLATE, CALL = "round template", "call"
TEMPLATES_MAX, OPEN_MAX, ENDED_MAX = 200, 100, 100


class CallBook(Industry):
    """Book of calls: read from memory, stored in the robot's ledger."""

    def __init__(self, robot: Robot) -> None:
        self._robot, self._ledger = robot, robot[Ledger]
        self._templates = {id: msgspec.convert(d, RoundTemplate) for id, d in self._ledger.all(TEMPLATE)}
        self._calls = {id: msgspec.convert(d, Call) for id, d in self._ledger.all(CALL)}

    @property
    def templates(self) -> Sequence[RoundTemplate]:
        return tuple(self._templates.values())

    async def put_template(self, template: RoundTemplate) -> None:
        for operation in template.operations:
            place_named(self._robot, operation.place)
        if len(self._templates.keys() | {template.key}) > TEMPLATES_MAX:
            raise Refused(f"more than {TEMPLATES_MAX} templates")
        await self._ledger.write(TEMPLATE, {template.key: msgspec.to_builtins(template)})
        self._templates[template.key] = template

    async def remove_template(self, key: str) -> None:
        self._template(key)
        await self._ledger.write(TEMPLATE, {}, forget=[key])
        self._templates.pop(key, None)

    @property
    def calls(self) -> Sequence[Call]:
        return tuple(self._calls.values())

    async def call(self, kind: CallKind, target: str, *, template: str = "") -> Call:
        place_named(self._robot, target)
        operations = self._template(template).operations if kind is CallKind.BY_TEMPLATE else ()
        if sum(not call.status.ended for call in self._calls.values()) >= OPEN_MAX:
            raise Refused(f"more than {OPEN_MAX} calls wait")
        new = Call(
            id=str(uuid.uuid4()),
            number=uuid.uuid4().hex,
            kind=kind,
            target=target,
            template=template,
            operations=operations,
            changed_at=self._robot.clock.epoch(),
        )
        return await self._write(new)

    async def report(self, id: str, status: OrderStatus, reason: str = "") -> Call:
        if (call := self._calls.get(id)) is None:
            raise NotFound(f"there is no call {id}")
        if call.status.ended:
            raise Refused(f"the call has ended: {call.status.value}")
        if status not in (OrderStatus.RUNNING, OrderStatus.SUCCEEDED, OrderStatus.FAILED):
            raise InvalidGoal(f"a client cannot report {status.value}")
        now = self._robot.clock.epoch()
        return await self._write(
            replace(call, status=status, reason=reason, began_at=call.began_at or now, changed_at=now)
        )

    async def _write(self, call: Call) -> Call:
        ended = [known.id for known in self._calls.values() if known.status.ended and known.id != call.id]
        surplus = ended[: max(0, len(ended) - ENDED_MAX)]
        await self._ledger.write(CALL, {call.id: msgspec.to_builtins(call)}, forget=surplus)
        self._calls[call.id] = call
        for id in surplus:
            self._calls.pop(id, None)
        return call

    def _template(self, key: str) -> RoundTemplate:
        if (template := self._templates.get(key)) is None:
            raise NotFound(f"there is no template {key!r}")
        return template
