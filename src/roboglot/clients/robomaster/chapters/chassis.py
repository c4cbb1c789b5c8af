"""The chassis chapter (manual 3.2.3). m, m/s, degrees, rpm; x forward, y right, z clockwise."""

from __future__ import annotations

from roboglot.clients.errors import BadAnswer
from roboglot.clients.robomaster.calls import Chapter, on_off
from roboglot.values import dataclass
from roboglot.wire.robomaster.telemetry import ChassisAttitude, ChassisStatus, status_of


@dataclass(frozen=True, slots=True)
class ChassisSpeed:
    """m/s, m/s, degrees/s, and the wheels' rpm in the robot's order (robots' differs from the manual's)."""

    x: float
    y: float
    z: float
    w1: float
    w2: float
    w3: float
    w4: float


@dataclass(frozen=True, slots=True)
class ChassisPose:
    """m, m, degrees since power-on (robots: since ``command``)."""

    x: float
    y: float
    z: float


class Chassis(Chapter):
    """``client.chassis``."""

    async def speed(self, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> None:
        """Drive at a velocity until the next command (3.2.3.1)."""
        await self._do("chassis speed", x=x, y=y, z=z)

    async def wheel(self, w1: float = 0, w2: float = 0, w3: float = 0, w4: float = 0) -> None:
        """Turn the wheels at these rpm (3.2.3.2)."""
        await self._do("chassis wheel", w1=w1, w2=w2, w3=w3, w4=w4)

    async def move(
        self,
        x: float | None = None,
        y: float | None = None,
        z: float | None = None,
        *,
        vxy: float | None = None,
        vz: float | None = None,
        wait: bool = False,
    ) -> None:
        """Move by x, y m and z degrees (3.2.3.3); with ``wait`` it returns when the robot is there."""
        await self._do("chassis move", x=x, y=y, z=z, vxy=vxy, vz=vz, wait=wait or None)

    async def stop(self) -> None:
        """Stop; in no manual."""
        await self._do("chassis stop")

    async def get_speed(self) -> ChassisSpeed:
        """Return the measured speeds (3.2.3.4)."""
        return ChassisSpeed(*await self._numbers("chassis speed", 7))

    async def get_position(self) -> ChassisPose:
        """Return the position (3.2.3.5)."""
        return ChassisPose(*await self._numbers("chassis position", 3))

    async def get_attitude(self) -> ChassisAttitude:
        """Return the attitude (3.2.3.6)."""
        return ChassisAttitude(*await self._numbers("chassis attitude", 3))

    async def get_status(self) -> ChassisStatus:
        """Return the motion flags (3.2.3.7)."""
        words = await self._words("chassis status", 11)
        try:
            return status_of(words)
        except ValueError as error:
            raise BadAnswer(str(error)) from None

    async def push(
        self,
        *,
        position: bool | None = None,
        pfreq: int | None = None,
        attitude: bool | None = None,
        afreq: int | None = None,
        status: bool | None = None,
        sfreq: int | None = None,
        freq: int | None = None,
    ) -> None:
        """Switch ChassisPosition, ChassisAttitude, ChassisStatus on or off, at 1, 5, 10, 20, 30, 50 Hz (3.2.3.8)."""
        await self._do(
            "chassis push",
            position=on_off(position), pfreq=pfreq, attitude=on_off(attitude), afreq=afreq,
            status=on_off(status), sfreq=sfreq, freq=freq,
        )  # fmt: skip
