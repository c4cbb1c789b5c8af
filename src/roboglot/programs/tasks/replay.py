"""Replay of a revived program: its calls get their recorded answers, from which the host's state is restored."""

from __future__ import annotations

import msgspec

from roboglot.model.errors import RobotError
from roboglot.programs.engine.events import Replayed
from roboglot.programs.functions.session import Session
from roboglot.programs.functions.table import call as call_function
from roboglot.programs.functions.table import remember
from roboglot.programs.language.names import EXCEPTIONS
from roboglot.programs.tasks.block_stops import MARKS
from roboglot.programs.tasks.run_host import RunHost
from roboglot.programs.worker.values import unpack

_REMEMBERED_MAX = 16 * 1024  # bytes of an answer; the states of longer answers (measurements, lists) are not restored


class Replay:
    """Restores the state of a session and its host. ``left``: recorded calls that are still to be replayed.

    ``ahead``: lead of the program's ``time.monotonic`` over the clock, which restarted after the crash, s.
    """

    def __init__(self, session: Session, host: RunHost, left: int) -> None:
        self._session, self._host, self.left = session, host, left
        self.ahead = 0.0

    async def follow(self, call: Replayed) -> None:
        """Restore the effects on the host of a call that is not made again."""
        if call.name in MARKS and call.args:
            self._host.restore_block(str(call.args[0]))
        elif call.name.endswith(".set_log"):
            await call_function(self._session, call.name, call.args, call.kwargs)
        elif call.name == "time.monotonic":
            answer, now = msgspec.json.decode(call.answer).get("value"), self._session.robot.clock.time()
            self.ahead = max(0.0, float(answer) - now) if isinstance(answer, (int, float)) else 0.0
        elif len(call.answer) <= _REMEMBERED_MAX:
            self._remember(call)

    def _remember(self, call: Replayed) -> None:
        """Restore the state of the call's group, which ``cyberdog.motion.state`` and the like read."""
        answer = msgspec.json.decode(call.answer)
        if answer["t"] == "value":
            remember(self._session, call.name, unpack(answer["value"]))
        elif answer["type"] not in EXCEPTIONS:
            remember(self._session, call.name, RobotError(answer["message"]))
