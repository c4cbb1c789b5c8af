"""Chapter "motion": servo frames (1002), motions with a result (1004), standing before stairs (1100, 1101)."""

from __future__ import annotations

import asyncio
from types import TracebackType

import msgspec

from roboglot.clients.cyberdog.calls import Calls, CyberDogRefused
from roboglot.clients.errors import LinkLost
from roboglot.wire.cyberdog.chapters.motion.motion import CommandType, Motion, MotionCode
from roboglot.wire.cyberdog.codes import Code

FRAME_PERIOD = 0.1  # s; the robot stops after 0.2 s without a frame
MOTION_MAX = 25.0  # s: the robot itself answers within 20
STEP = (0.05, 0.05)  # lift of the front and the rear feet, m


class _Outcome(msgspec.Struct):
    motion_id: int
    result: bool
    code: int


class _Success(msgspec.Struct):
    success: bool


class MotionChapter(Calls):
    """Motions. Velocities are in m/s and rad/s: x forward, y left, yaw counter-clockwise."""

    async def perform(self, motion: int, *, seconds: float = 0.0, velocity: tuple[float, float, float] | None = None,
                      position: tuple[float, float, float] | None = None,
                      attitude: tuple[float, float, float] | None = None) -> None:  # fmt: skip
        """1004: perform a motion to its end. Raises CyberDogRefused with the code (30xx) and its name."""
        params: dict[str, object] = {"motion_id": int(motion), "cmd_source": 0, "duration": round(1000 * seconds)}
        for name, values in (("vel_des", velocity), ("pos_des", position), ("rpy_des", attitude)):
            if values is not None:
                params[name] = [float(value) for value in values]
        reply = await self.ask(Code.MOTION, _Outcome, params, within=MOTION_MAX)
        if not reply.result:
            known = reply.code in tuple(MotionCode)
            words = MotionCode(reply.code).name.lower().replace("_", " ") if known else "unknown"
            raise CyberDogRefused(f"motion {int(motion)}", reply.code, words)

    async def stand(self) -> None:
        """Stand up."""
        await self.perform(Motion.STAND_UP)

    async def lie_down(self) -> None:
        """Lie down on the belly."""
        await self.perform(Motion.LIE_DOWN)

    async def emergency_stop(self) -> None:
        """Release all motors at once; ``stand`` recovers."""
        await self.perform(Motion.EMERGENCY_STOP)

    async def servo_frame(self, motion: int, x: float, y: float, yaw: float, *, cmd_id: int | None = None,
                          lift: tuple[float, float] = STEP) -> None:  # fmt: skip
        """1002: send one frame, valid for 200 ms; ``lift`` of the feet, m. Its result is pushed (ServoResponse)."""
        frame: dict[str, object] = {
            "motion_id": int(motion),
            "cmd_type": int(CommandType.DATA),
            "cmd_source": 0,
            "vel_des": [float(x), float(y), float(yaw)],
            "step_height": list(lift),
        }
        await self.text(Code.SERVO, frame if cmd_id is None else {**frame, "cmd_id": cmd_id}, within=1.0)

    async def end_servo(self, motion: int = Motion.TROT_SLOW) -> None:
        """1002: send the last frame; the robot stops."""
        await self.text(Code.SERVO, {"motion_id": int(motion), "cmd_type": int(CommandType.END)}, within=1.0)

    async def align_with_stairs(self, *, up: bool) -> bool:
        """1100: align with the stairs ahead; False if it sees none. The robot is still moving after the answer."""
        reply = await self.ask(Code.ALIGN_WITH_STAIRS, _Success, {"data": up})
        return reply.success

    async def end_stair_alignment(self) -> None:
        """1101: stop the alignment where the robot is."""
        await self.do(Code.END_STAIR_ALIGNMENT)

    def servo(self, motion: int = Motion.TROT_SLOW) -> Servo:
        """Drive by ``async with client.servo() as joystick: joystick.set(0.3, 0, 0)``; stops at the end."""
        return Servo(self, motion)


class Servo:
    """Sends frames while open; ends when the link is lost, which the next ``set`` raises."""

    def __init__(self, motion_chapter: MotionChapter, motion: int) -> None:
        self._chapter, self._motion = motion_chapter, motion
        self._velocity = (0.0, 0.0, 0.0)
        self._sending: asyncio.Task[None] | None = None

    async def __aenter__(self) -> Servo:
        self._sending = asyncio.get_running_loop().create_task(self._send(), name="servo")
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self._sending is not None
        self._sending.cancel()
        await asyncio.gather(self._sending, return_exceptions=True)
        await self._chapter.end_servo(self._motion)

    def set(self, x: float, y: float, yaw: float) -> None:
        """Set the velocity in m/s and rad/s. Raises LinkLost if frames no longer get through."""
        if self._sending and self._sending.done():
            raise LinkLost("the servo's frames no longer reach the robot")
        self._velocity = (x, y, yaw)

    async def _send(self) -> None:
        while True:
            await self._chapter.servo_frame(self._motion, *self._velocity)
            await self._chapter.clock.sleep(FRAME_PERIOD)
