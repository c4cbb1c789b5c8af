"""Realism of a body's sensors: ``clean`` without noise, ``usual`` as in its file, ``hard`` with large errors.

Chosen by a suffix of the body's name: ``hermes+hard``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from msgspec import Struct
from msgspec.structs import replace

from roboglot.simulation.components.sensing.imu import ImuSection
from roboglot.simulation.components.sensing.lidar import LidarSection
from roboglot.simulation.components.sensing.odometry import OdometrySection

USUAL = "usual"


def _clean_odometry(section: OdometrySection) -> OdometrySection:
    return replace(section, scale_error=0.0, noise=0.0, turn_slip=0.0, jump_every=0.0)


def _clean_imu(section: ImuSection) -> ImuSection:
    return replace(
        section, gyro_noise=0.0, gyro_bias=0.0, gyro_scale=0.0, acceleration_noise=0.0, acceleration_bias=0.0
    )


def _clean_lidar(section: LidarSection) -> LidarSection:
    return replace(section, noise=0.0, dropouts=0.0, sector_every=0.0, jitter=0.0, dark=0.0, gloss=False)


def _hard_odometry(section: OdometrySection) -> OdometrySection:
    """Return odometry with wrong wheel sizes, slip, and an encoder that misses counts."""
    scale, noise = max(0.06, 3.0 * section.scale_error), max(0.05, 3.0 * section.noise)
    return replace(section, scale_error=scale, noise=noise, turn_slip=0.1, jump=0.04, jump_every=30.0)


def _hard_imu(section: ImuSection) -> ImuSection:
    bias, scale = max(0.004, 3.0 * section.gyro_bias), max(0.008, 3.0 * section.gyro_scale)
    return replace(section, gyro_noise=2.0 * section.gyro_noise, gyro_bias=bias, gyro_scale=scale)


def _hard_lidar(section: LidarSection) -> LidarSection:
    """Return a lidar with dropouts, black furniture, lost packets and late stamps."""
    return replace(section, noise=max(0.02, section.noise), dropouts=0.03, sector_every=4.0, jitter=0.03, dark=0.2)


PRESETS: Mapping[str, Mapping[type[Struct], Callable[..., Struct]]] = {
    "clean": {OdometrySection: _clean_odometry, ImuSection: _clean_imu, LidarSection: _clean_lidar},
    USUAL: {},
    "hard": {OdometrySection: _hard_odometry, ImuSection: _hard_imu, LidarSection: _hard_lidar},
}


def with_realism(sections: Mapping[type[Struct], Struct], preset: str) -> dict[type[Struct], Struct]:
    """Return the sections of a body changed by a preset. Raises KeyError for an unknown preset."""
    changes = PRESETS[preset]
    return {kind: changes[kind](section) if kind in changes else section for kind, section in sections.items()}
