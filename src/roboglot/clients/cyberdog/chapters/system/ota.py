"""Chapter "ota": 5001 to 5011."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import aclosing
from typing import Any

import msgspec

from roboglot.clients.cyberdog.calls import Calls, CyberDogRefused, check
from roboglot.clients.cyberdog.values import UpdateProgress, UpdateStatus
from roboglot.clients.errors import LinkLost
from roboglot.wire.cyberdog.codes import Accepted, Code

OnUpdate = Callable[[str, float], object]  # the state and the progress, 0..1


class _Time(msgspec.Struct):
    time: int


class Updates(Calls):
    """Updates of the robot's software."""

    async def update_status(self) -> UpdateStatus:
        """5001: return the state of the update."""
        return await self.ask(Code.UPDATE_STATUS, UpdateStatus)

    async def download_update(self, modules: Sequence[Mapping[str, object]]) -> None:
        """5003: download modules, described as by the maker's server; UpdateProgress is pushed."""
        await self.do(Code.DOWNLOAD_UPDATE, {"modules": modules})

    async def install_update(self, md5: str) -> None:
        """5004: install; UpdateProgress, UpdateReboots and UpdateResult are pushed."""
        await self.do(Code.INSTALL_UPDATE, {"md5": md5})

    async def update_progress(self) -> UpdateProgress:
        """5005: return the progress of the update."""
        return await self.ask(Code.UPDATE_PROGRESS, UpdateProgress)

    async def update_time(self) -> int:
        """5006: return the remaining time of the update, s; below 0: unknown."""
        return (await self.ask(Code.UPDATE_TIME, _Time)).time

    async def update(
        self, operate: str, data: object = None, on_feedback: OnUpdate | None = None
    ) -> Mapping[str, object]:
        """5010: "inquire", "download", "upgrade" or another operation of the robot; return the result's ``data``.

        Raises CyberDogRefused if not accepted (2), or with the result's code after a failure.
        """
        return await self._goal(Code.START_UPDATE, {"operate": operate, "data": data}, on_feedback)

    async def join_update(self, on_feedback: OnUpdate | None = None) -> Mapping[str, object]:
        """5011: join the running goal, from its latest feedback on. Raises CyberDogRefused (3) if there is none."""
        return await self._goal(Code.JOIN_UPDATE, {}, on_feedback)

    async def _goal(self, code: Code, params: dict[str, object], on_feedback: OnUpdate | None) -> Mapping[str, object]:
        async with aclosing(self.parts(code, dict[str, Any], params)) as answers:
            async for answer in answers:
                if answer.get("accepted", Accepted.YES) != Accepted.YES:
                    raise CyberDogRefused(code.name, int(answer["accepted"]), "not accepted")
                if "code" in answer:
                    check(code, {"result": answer["code"], "message": answer.get("message", "")})
                    return dict(answer.get("data") or {})
                if on_feedback and "state" in answer:
                    on_feedback(str(answer["state"]), float(answer.get("progress", 0)) / 100)
        raise LinkLost(f"{code.name}: the stream ended without a result")
