"""Enrols and recognises members' faces, and pushes the outcomes (7003, 7004)."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Coroutine
from enum import IntEnum

from roboglot.model.components.interaction.members import Members
from roboglot.model.components.sensing.vision import Vision
from roboglot.model.errors import NotFound, RobotError
from roboglot.model.events import MembersChanged
from roboglot.model.perception import Emotion, FaceSeen
from roboglot.model.robot import Robot
from roboglot.protocols.cyberdog.app_link import AppLink
from roboglot.protocols.cyberdog.chapters.people.expected_member import ExpectedMember
from roboglot.protocols.cyberdog.table import push
from roboglot.wire.cyberdog.codes import Code

log = logging.getLogger(__name__)
ENTERED = push(Code.FACE_ENTERED)
RECOGNISED = push(Code.FACE_RECOGNISED)
ENTERING_MAX = 30.0  # s for a face to be seen
AGAIN = 1.0  # s between two reports of the same person
EMOTIONS = tuple(Emotion)


class FaceResult(IntEnum):
    """``result`` of this chapter's answers and pushes."""

    DONE = 0
    UNDEFINED = 5901
    STATE = 5903
    INNER = 5904
    TIMEOUT = 5907
    ARGUMENTS = 5910
    BUSY = 5911
    KNOWN = 5921


class Faces:
    """Enrols one face or recognises faces, not both at once. Lives as long as the door is open."""

    def __init__(self, robot: Robot, app: AppLink) -> None:
        self._expected = ExpectedMember(robot)
        self._entered = ExpectedMember(robot)
        self._wanted = ExpectedMember(robot)
        self._asked = ""  # the expected member's name in the request
        self._robot, self._app = robot, app
        self._adding = False  # the member whose face is to be entered
        self._looking: asyncio.Task[None] | None = None
        self._leave = robot.events.listen(MembersChanged, self._end_if_removed)

    @property
    def entering(self) -> str:
        """The member whose face is expected, by the present name; "" for none."""
        return self._expected.name

    @property
    def entered(self) -> str:
        """The member whose face was recorded last, by the present name; "" for none."""
        return self._entered.name

    @property
    def busy(self) -> bool:
        """True while enrolling or recognising, and from the request on."""
        return self._adding or (self._looking is not None and not self._looking.done())

    async def enter(self, name: str, *, host: bool) -> None:
        """Enrol the next face for a member, added if unknown; push 7003 reports the outcome. Raises InvalidGoal."""
        members = self._robot[Members]
        if name not in {member.name for member in members.all()}:
            self._adding = True
            try:
                await members.add(name, host=host)
            finally:
                self._adding = False
        self._expected.expect(name)
        self._asked = name
        self._begin(self._enter())

    def recognise(self, name: str, id: int, seconds: float) -> None:
        """Push 7004 for each member (only ``name``, if given) seen within ``seconds``; 5907 if none was."""
        self._wanted.clear()
        with contextlib.suppress(NotFound):  # perhaps it is added meanwhile
            self._wanted.expect(name)
        self._begin(self._recognise(name, id, seconds))

    def stop(self) -> None:
        """Stop without a report."""
        if self._looking:
            self._looking.cancel()
        self._looking = None
        self._expected.clear()

    def close(self) -> None:
        """Stop for good."""
        self._leave()
        self.stop()

    def _begin(self, work: Coroutine[object, None, None]) -> None:
        self._looking = asyncio.get_running_loop().create_task(work, name="faces")

    async def _enter(self) -> None:
        try:
            face = await self._robot.clock.wait_for(self._next_face(), ENTERING_MAX)
            if face.name not in ("", self.entering):
                result = FaceResult.KNOWN
            else:
                await self._robot[Members].set_face(self.entering, face.print)
                self._entered.expect(self.entering)
                result = FaceResult.DONE
        except TimeoutError:
            result = FaceResult.TIMEOUT
        except RobotError as error:
            log.info("cannot enter the face of %r: %s", self.entering or self._asked, error)
            result = FaceResult.INNER
        self._report(result)

    def _report(self, result: FaceResult) -> None:
        name = self.entering or self._asked
        self._expected.clear()
        self._app.push(ENTERED, {"result": int(result), "username": name})

    def _end_if_removed(self, _event: MembersChanged) -> None:
        if self._expected.removed:
            if self._looking:
                self._looking.cancel()
            self._looking = None
            self._report(FaceResult.INNER)

    async def _next_face(self) -> FaceSeen:
        with self._robot[Vision].faces.subscribe() as sightings:
            async for sighting in sightings:
                if sighting.seen:
                    return sighting.seen[0]
        raise RobotError("the camera is gone")

    async def _recognise(self, name: str, id: int, seconds: float) -> None:
        reported: dict[str, float] = {}
        try:
            await self._robot.clock.wait_for(self._push_faces(name, id, reported), seconds)
        except TimeoutError:
            if not reported:
                name = self._wanted.name or name
                self._app.push(RECOGNISED, _recognised(FaceResult.TIMEOUT, name, id, 0.0, 0.0))
        except RobotError as error:
            log.info("face recognition ended: %s", error)

    async def _push_faces(self, wanted: str, id: int, reported: dict[str, float]) -> None:
        with self._robot[Vision].faces.subscribe() as sightings:
            async for sighting in sightings:
                for face in sighting.seen:
                    again = sighting.stamp - reported.get(face.name, -AGAIN) < AGAIN
                    if not face.name or again or (wanted and face.name != (self._wanted.name or wanted)):
                        continue
                    reported[face.name] = sighting.stamp
                    emotion = float(EMOTIONS.index(face.emotion))
                    self._app.push(RECOGNISED, _recognised(FaceResult.DONE, face.name, id, face.age, emotion))


def _recognised(result: FaceResult, name: str, id: int, age: float, emotion: float) -> dict[str, object]:
    return {"username": name, "result": int(result), "id": id, "age": age, "emotion": emotion}
