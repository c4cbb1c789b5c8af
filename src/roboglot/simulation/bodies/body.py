"""Declarative descriptions of robot bodies: which components there are and their parameters. SI units.

A section that is absent is a component that the robot does not have; hull and base it must have.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from msgspec import Meta, Struct, field

from roboglot.model.components.motion.gaits import Gait
from roboglot.model.components.motion.legs import LegLimits
from roboglot.model.robot import Description
from roboglot.simulation.bodies import body_parts as parts
from roboglot.simulation.bodies.body_senses import (
    Bluetooth,
    Firmware,
    Gps,
    Hearing,
    Motors,
    Power,
    Reflectors,
    TimeOfFlight,
    Touch,
    TrafficRadio,
    UltraWideband,
    Vision,
)
from roboglot.simulation.world.declarations import BadFile, read_toml

BODIES = Path(__file__).parent
RAYS_MAX = 2000

Positive = Annotated[float, Meta(gt=0, le=10_000)]
NotNegative = Annotated[float, Meta(ge=0, le=10_000)]
Fraction = Annotated[float, Meta(ge=0, le=1)]


class Hull(Struct, frozen=True, forbid_unknown_fields=True):
    """Two cylinders, chassis and torso, of one radius around base_link."""

    radius: Positive
    height: Positive
    mass: Positive
    clearance: Positive
    chassis_height: Positive
    torso_height: Positive


class Base(Struct, frozen=True, forbid_unknown_fields=True):
    """Four mecanum wheels at the corners of ``wheel_base`` x ``track``, or one driven wheel at each side, ``track``
    apart; top speeds and accelerations.
    """

    speed: Positive
    yaw_speed: Positive
    acceleration: Positive
    yaw_acceleration: Positive
    wheel_radius: Positive
    wheel_base: Positive
    track: Positive
    traction: Positive
    drive: Literal["mecanum", "differential"] = "mecanum"


class Legs(Struct, frozen=True, forbid_unknown_fields=True):
    """Belly heights (m) and how long the ways between them take (s); ``lowest`` to ``highest`` can be held standing.

    ``angle_max`` (rad) and ``shift_max`` (m) of the body against the feet; powers in W; with a charge up to
    ``tired_below`` no motion is performed; without a ``gait`` of its own the body rolls on its wheels. ``reach``: how
    far from below its hip a foot stands at most, m.
    """

    standing: Positive
    lying: Positive
    stand_time: Positive
    lie_time: Positive
    lowest: Positive = 0.10
    highest: Positive = 0.30
    angle_max: Positive = 0.45
    shift_max: Positive = 0.10
    reach: Positive = 0.15
    perform_power: NotNegative = 60.0
    tired_below: Fraction = 0.20
    gait: Gait | None = None

    @property
    def limits(self) -> LegLimits:
        """What can be asked of such legs."""
        return LegLimits(
            lowest=self.lowest, highest=self.highest, angle=self.angle_max, shift=self.shift_max, reach=self.reach
        )


class Imu(Struct, frozen=True, forbid_unknown_fields=True):
    """Standard deviations of noise, constant bias and scale error of gyro (rad/s) and accelerometer (m/s2)."""

    gyro_noise: NotNegative
    gyro_bias: NotNegative
    gyro_scale: NotNegative
    acceleration_noise: NotNegative
    acceleration_bias: NotNegative


class Odometry(Struct, frozen=True, forbid_unknown_fields=True):
    """Standard deviations of the wheels' scale error and of the noise per way travelled."""

    scale_error: NotNegative
    noise: NotNegative
    still_rate: NotNegative


class Lidar(Struct, frozen=True, forbid_unknown_fields=True):
    """A full turn of ``rays``; ``above_belly`` is the height of its plane above the belly."""

    rays: Annotated[int, Meta(ge=4, le=RAYS_MAX)]
    rate: Annotated[float, Meta(gt=0, le=50)]
    range_min: NotNegative
    range_max: Positive
    noise: NotNegative
    above_belly: NotNegative


class Battery(Struct, frozen=True, forbid_unknown_fields=True):
    """Capacity in Wh; powers in W; ``resistance`` (ohm) makes the voltage sag and the cells warm.

    ``dock`` says how a dock charges it: through "contacts" or "wireless", by a coil. ``life``: cycles after which it
    holds four fifths of its capacity.
    """

    capacity: Positive
    cells: Annotated[int, Meta(ge=1, le=100)]
    charge: Fraction
    idle_power: NotNegative
    efficiency: Annotated[float, Meta(gt=0, le=1)]
    rolling_resistance: NotNegative
    charge_power: NotNegative
    resistance: NotNegative
    cycles: Annotated[int, Meta(ge=0)]
    dock: Literal["contacts", "wireless"] = "contacts"
    life: Annotated[int, Meta(ge=1, le=100_000)] = 800


class DockContact(Struct, frozen=True, forbid_unknown_fields=True):
    """How near (m) and straight (rad) the rear contacts must be to a dock."""

    distance: Positive
    angle: Positive


class Bumper(Struct, frozen=True, forbid_unknown_fields=True):
    """Four zones around the hull; ``touch_speed`` (m/s): the fastest that it lets the hull come upon what it feels."""

    touch_speed: Positive = 0.1


class Modem(Struct, frozen=True, forbid_unknown_fields=True):
    """A mobile modem: the access point name that it was made with, and the weakest signal (dBm) that it can use."""

    apn: str
    sensitivity: Annotated[float, Meta(ge=-140, le=-40)] = -110.0


class Network(Struct, frozen=True, forbid_unknown_fields=True):
    """A Wi-Fi card; ``noise`` in dB. ``known``: the networks (ssid: password) that a new robot joins.

    ``maker``: the first half of its hardware address; ``name``, ``password`` and ``address`` are those of its own
    network when it is an access point (the name is followed by the end of its hardware address); ``wired``: address
    and prefix length of the socket on the hull.
    """

    noise: NotNegative
    known: dict[str, str] = field(default_factory=lambda: {"roboglot": "roboglot"})
    maker: Annotated[str, Meta(pattern="^[0-9a-f]{2}:[0-9a-f]{2}:[0-9a-f]{2}$")] = "02:00:5e"
    name: Annotated[str, Meta(min_length=1, max_length=25)] = "roboglot"
    password: Annotated[str, Meta(max_length=63)] = ""
    address: str = "192.168.43.1"
    wired: str = ""
    modem: Modem | None = None


class Camera(Struct, frozen=True, forbid_unknown_fields=True):
    """Pictures; ``fov``: horizontal, rad; ``forward`` and ``above_belly``: where it sits; ``pitch``: rad, nose down."""

    width: Annotated[int, Meta(ge=64, le=1920, multiple_of=16)]
    height: Annotated[int, Meta(ge=64, le=1080, multiple_of=2)]
    rate: Annotated[float, Meta(gt=0, le=60)]
    fov: Annotated[float, Meta(gt=0.1, lt=2.5)]
    forward: Annotated[float, Meta(ge=-5, le=5)]
    above_belly: NotNegative
    pitch: Annotated[float, Meta(ge=-1.5, le=1.5)] = 0.0


class Microphone(Struct, frozen=True, forbid_unknown_fields=True):
    """``noise``: the room's murmur, root mean square, of full scale."""

    noise: Annotated[float, Meta(ge=0, le=0.5)]


class Speaker(Struct, frozen=True, forbid_unknown_fields=True):
    """``loudness``: how loud full volume is a metre away, of a microphone's full scale."""

    loudness: Annotated[float, Meta(gt=0, le=10)]


class Cliff(Struct, frozen=True, forbid_unknown_fields=True):
    """Sensors at the hull's rim that look ``ahead`` m beyond it."""

    ahead: NotNegative


class EmergencyStop(Struct, frozen=True, forbid_unknown_fields=True):
    """A button, and its twin in the software."""


class EmergencyBraking(Struct, frozen=True, forbid_unknown_fields=True):
    """Cuts in when the way to stop, and ``margin`` m, is longer than what the lidar sees free; ``on`` at the start."""

    margin: Positive
    on: bool = True


class Jack(Struct, frozen=True, forbid_unknown_fields=True):
    """A platform on the hull; ``time`` (s) for the whole ``stroke`` (m)."""

    stroke: Positive
    time: Positive


class Compartment(Struct, frozen=True, forbid_unknown_fields=True):
    """A group of ``boxes`` side by side."""

    orientation: Literal["front", "back", "top"] = "front"
    kind: Literal["takeout", "retail"] = "takeout"
    boxes: Annotated[int, Meta(ge=1, le=20)] = 1


class Cargo(Struct, frozen=True, forbid_unknown_fields=True):
    """Compartments from below; ``door_time`` (s) for a door's whole way."""

    compartments: Annotated[tuple[Compartment, ...], Meta(min_length=1, max_length=20)]
    door_time: Positive


class DepthCamera(Struct, frozen=True, forbid_unknown_fields=True):
    """Looks ahead from ``above_ground`` m, ``forward`` of the middle, ``pitch`` rad down; field of view in rad."""

    rows: Annotated[int, Meta(ge=2, le=240)]
    columns: Annotated[int, Meta(ge=2, le=320)]
    width: Annotated[float, Meta(gt=0, lt=3)]
    height: Annotated[float, Meta(gt=0, lt=3)]
    rate: Annotated[float, Meta(gt=0, le=30)]
    range_min: NotNegative
    range_max: Positive
    noise: NotNegative
    above_ground: Positive
    forward: Annotated[float, Meta(ge=-5, le=5)]
    pitch: Annotated[float, Meta(ge=-1.5, le=1.5)] = 0.0


class LiftClient(Struct, frozen=True, forbid_unknown_fields=True):
    """A radio that hears the lift from ``signal_min`` dBm of Wi-Fi on."""

    signal_min: Annotated[float, Meta(ge=-120, le=0)] = -85.0


class Body(Struct, frozen=True, forbid_unknown_fields=True):
    """A kind of robot."""

    maker: str
    model: str
    hardware_version: str
    hull: Hull
    base: Base
    legs: Legs | None = None
    imu: Imu | None = None
    odometry: Odometry | None = None
    lidar: Lidar | None = None
    battery: Battery | None = None
    dock_contact: DockContact | None = None
    bumper: Bumper | None = None
    network: Network | None = None
    traffic_radio: TrafficRadio | None = None
    camera: Camera | None = None
    microphone: Microphone | None = None
    speaker: Speaker | None = None
    vision: Vision | None = None
    hearing: Hearing | None = None
    reflectors: Reflectors | None = None
    cliff: Cliff | None = None
    emergency_stop: EmergencyStop | None = None
    emergency_braking: EmergencyBraking | None = None
    jack: Jack | None = None
    cargo: Cargo | None = None
    depth_camera: DepthCamera | None = None
    lift_client: LiftClient | None = None
    time_of_flight: TimeOfFlight | None = None
    touch: Touch | None = None
    gps: Gps | None = None
    motors: Motors | None = None
    bluetooth: Bluetooth | None = None
    ultra_wideband: UltraWideband | None = None
    firmware: Firmware | None = None
    power: Power | None = None
    gimbal: parts.Gimbal | None = None
    blaster: parts.Blaster | None = None
    armor: parts.Armor | None = None
    light: parts.Light | None = None
    skin: parts.Skin | None = None
    arm: parts.Arm | None = None
    gripper: parts.Gripper | None = None
    servos: parts.Servos | None = None
    pwm_ports: parts.PwmPorts | None = None
    sensor_adapters: parts.SensorAdapters | None = None
    range_sensors: parts.RangeSensors | None = None
    motion_status: parts.MotionStatus | None = None

    @property
    def walks(self) -> bool:
        """Whether it has feet, and no wheels."""
        return self.legs is not None and self.legs.gait is not None

    def describe(self, serial: str, software_version: str) -> Description:
        """The name plate of one robot of this kind."""
        return Description(
            maker=self.maker,
            model=self.model,
            serial=serial,
            hardware_version=self.hardware_version,
            software_version=software_version,
            radius=self.hull.radius,
            height=self.hull.height,
        )


def load_body(name: str) -> Body:
    """A shipped body by its name, or one's own by the path of its TOML file. Raises BadFile."""
    path = Path(name) if name.endswith(".toml") else BODIES / f"{name}.toml"
    if not name.endswith(".toml") and (not name.isidentifier() or not path.is_file()):
        known = ", ".join(sorted(file.stem for file in BODIES.glob("*.toml")))
        raise BadFile(f"no body is named {name!r}; there are: {known}; or give the path of a .toml file")
    body = read_toml(path, Body)
    if body.odometry and not body.imu:
        raise BadFile(f"{path}: [odometry] takes its heading from an [imu]")
    for part, needed in (("vision", "camera"), ("hearing", "microphone"), ("reflectors", "lidar")):
        if getattr(body, part) and not getattr(body, needed):
            raise BadFile(f"{path}: [{part}] works with what a [{needed}] takes")
    if body.motion_status and not body.imu:
        raise BadFile(f"{path}: [motion_status] feels blows with an [imu]")
    if body.blaster and not body.gimbal:
        raise BadFile(f"{path}: [blaster] is aimed by a [gimbal]")
    if body.gripper and not body.arm:
        raise BadFile(f"{path}: [gripper] sits on an [arm]")
    return body
