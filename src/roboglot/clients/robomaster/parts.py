"""The chapters of the EP's smaller parts (manual 3.2.6 to 3.2.14). Degrees, mm, V and cm in the manual's build.

Robots answer infrared distances, voltages, arm positions and the gripper's state in other units and numbers than the
manual has; nothing is converted here.
"""

from __future__ import annotations

from dataclasses import dataclass

from roboglot.clients.robomaster.chapter import Chapter, on_off


@dataclass(frozen=True, slots=True)
class ArmPosition:
    """Forward and up: the manual's cm, robots' mm."""

    x: float
    y: float


class Armor(Chapter):
    """``client.armor``."""

    async def sensitivity(self, value: int) -> None:
        """1 to 10 (3.2.6.1)."""
        await self._do("armor sensitivity", value)

    async def get_sensitivity(self) -> int:
        """3.2.6.2."""
        return round(await self._number("armor sensitivity"))

    async def event(self, hit: bool) -> None:
        """Switch ArmorHit on or off (3.2.6.3)."""
        await self._do("armor event", hit=on_off(hit))


class Sound(Chapter):
    """``client.sound``."""

    async def event(self, applause: bool) -> None:
        """Switch Applause on or off (3.2.7.1)."""
        await self._do("sound event", applause=on_off(applause))


class Pwm(Chapter):
    """``client.pwm``. Bit n-1 of ``port_mask`` is output n."""

    async def value(self, port_mask: int, value: float) -> None:
        """Duty, percent (3.2.8.1)."""
        await self._do("pwm value", hex(port_mask), value)

    async def freq(self, port_mask: int, value: int) -> None:
        """Hz (3.2.8.2)."""
        await self._do("pwm freq", hex(port_mask), value)


class Led(Chapter):
    """``client.led``."""

    async def control(
        self,
        comp: str,
        effect: str,
        r: int = 255,
        g: int = 255,
        b: int = 255,
        *,
        blink_freq: int | None = None,
        single_led_index: int | None = None,
    ) -> None:
        """comp: all, top_all, bottom_left …; effect: solid, off, pulse, blink, scrolling (3.2.9.1)."""
        await self._do(
            "led control",
            comp=comp, r=r, g=g, b=b, effect=effect, blink_freq=blink_freq, single_led_index=single_led_index,
        )  # fmt: skip


class SensorAdapter(Chapter):
    """``client.sensor_adapter``. Adapters 1 to 6 have inputs 1 and 2."""

    async def get_adc(self, id: int, port: int) -> float:
        """V; robots: 0 to 1023 (3.2.10.1)."""
        return await self._number("sensor_adapter adc", id=id, port=port)

    async def get_io_level(self, id: int, port: int) -> int:
        """0 or 1 (3.2.10.2)."""
        return round(await self._number("sensor_adapter io_level", id=id, port=port))

    async def get_pulse_period(self, id: int, port: int) -> int:
        """ms (3.2.10.3)."""
        return round(await self._number("sensor_adapter pulse_period", id=id, port=port))

    async def event(self, io_level: bool) -> None:
        """Switch AdapterLevel on or off (3.2.10.4)."""
        await self._do("sensor_adapter event", io_level=on_off(io_level))


class IrDistanceSensor(Chapter):
    """``client.ir_distance_sensor``."""

    async def measure(self, on: bool) -> None:
        """All of them (3.2.11.1)."""
        await self._do("ir_distance_sensor measure", on_off(on))

    async def get_distance(self, id: int) -> float:
        """mm; robots: cm (3.2.11.2)."""
        return await self._number(f"ir_distance_sensor distance {id:d}")


class Servo(Chapter):
    """``client.servo``: 1 to 3."""

    async def angle(self, id: int, angle: float, *, wait: bool = False) -> None:
        """Turn to it (3.2.12.1)."""
        await self._do("servo angle", id=id, angle=angle, wait=wait or None)

    async def speed(self, id: int, speed: float) -> None:
        """Degrees/s (3.2.12.2)."""
        await self._do("servo speed", id=id, speed=speed)

    async def stop(self, id: int | None = None) -> None:
        """All of them, or one (3.2.12.3)."""
        await self._do("servo stop", id=id)

    async def recenter(self, id: int, *, wait: bool = False) -> None:
        """Turn to 0; undocumented."""
        await self._do("servo recenter", id=id, wait=wait or None)

    async def get_angle(self, id: int) -> float:
        """3.2.12.4."""
        return await self._number("servo angle", id=id)


class RoboticArm(Chapter):
    """``client.robotic_arm``."""

    async def move(self, x: float, y: float, *, wait: bool = False) -> None:
        """Move by an offset (3.2.13.1)."""
        await self._do("robotic_arm move", x=x, y=y, wait=wait or None)

    async def moveto(self, x: float, y: float, *, wait: bool = False) -> None:
        """Move to a position (3.2.13.2)."""
        await self._do("robotic_arm moveto", x=x, y=y, wait=wait or None)

    async def recenter(self, *, wait: bool = False) -> None:
        """3.2.13.3."""
        await self._do("robotic_arm recenter", wait=wait or None)

    async def stop(self) -> None:
        """3.2.13.4."""
        await self._do("robotic_arm stop")

    async def get_position(self) -> ArmPosition:
        """3.2.13.5."""
        return ArmPosition(*await self._numbers("robotic_arm position", 2))


class RoboticGripper(Chapter):
    """``client.robotic_gripper``."""

    async def open(self, level: int | None = None) -> None:
        """Open with force 1 to 4 (3.2.14.1)."""
        await self._do("robotic_gripper open", level)

    async def close(self, level: int | None = None) -> None:
        """Close with force 1 to 4 (3.2.14.2)."""
        await self._do("robotic_gripper close", level)

    async def stop(self) -> None:
        """Undocumented."""
        await self._do("robotic_gripper stop")

    async def get_status(self) -> int:
        """The manual's 0 closed, 1 between, 2 open; robots' 2, 0, 1 (3.2.14.3)."""
        return round(await self._number("robotic_gripper status"))
