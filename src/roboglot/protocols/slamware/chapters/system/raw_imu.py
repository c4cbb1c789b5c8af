"""Chapter "system": raw readings of the IMU's converters."""

from __future__ import annotations

from roboglot.model.components.sensing.imu import ImuConverters
from roboglot.model.sensing import RawImu
from roboglot.operations import Right
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.table import TABLE
from roboglot.protocols.slamware.vocabulary import milliseconds
from roboglot.wire.slamware.chapters.system.system import ImuCounts, ImuValues

API = "/api/core/system/v1"


@TABLE.on(f"GET {API}/rawadcimu", right=Right.SEE, needs=(ImuConverters,))
def get_imu_raw_adc_data(context: Context) -> ImuCounts:
    """Return the counts of accelerometer, gyro and compass."""
    raw = context.robot[ImuConverters].raw
    return ImuCounts(*raw.acceleration, *raw.rate, *raw.field, milliseconds(raw.stamp, context.robot.starts.base))


@TABLE.on(f"GET {API}/rawimu", right=Right.SEE, needs=(ImuConverters,))
def get_imu_raw_data(context: Context) -> ImuValues:
    """Return the uncorrected readings in m/s2, rad/s and microtesla."""
    raw = context.robot[ImuConverters].raw
    a, r, f = in_units(raw)
    stamp = milliseconds(raw.stamp, context.robot.starts.base)
    return ImuValues(a[0], a[1], a[2], r[0], r[1], r[2], f[0], f[1], f[2], stamp)


def in_units(raw: RawImu) -> tuple[list[float], list[float], list[float]]:
    """Return acceleration (m/s2), turning rate (rad/s) and magnetic field (microtesla), each x, y, z."""
    acceleration = [count * raw.acceleration_unit for count in raw.acceleration]
    rate = [count * raw.rate_unit for count in raw.rate]
    return acceleration, rate, [count * raw.field_unit * 1e6 for count in raw.field]
