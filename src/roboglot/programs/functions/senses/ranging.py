"""cyberdog.tof, cyberdog.ultrasonic and cyberdog.gps: distances, and the position on earth (4.4.11 to 4.4.15)."""

from __future__ import annotations

import numpy as np

from roboglot.model.components.sensing.gps import Gps
from roboglot.model.components.sensing.range_sensor import RangeReading, RangeSensors
from roboglot.model.components.sensing.time_of_flight import TimeOfFlight
from roboglot.programs.functions.results import header
from roboglot.programs.functions.senses.sensors import epoch, newer
from roboglot.programs.functions.session import Session
from roboglot.programs.functions.table import ABILITIES
from roboglot.programs.worker.values import Record

# SingleTofPayload.tof_position, and the model's name of the sensor.
TOF_POSITIONS = {"head left": 0, "head right": 1, "rear left": 2, "rear right": 3}
ULTRASONIC = "ultrasonic"
ULTRASOUND = 0  # radiation_type
GPS_EPOCH = 315_964_800  # s since 1970
LEAP_SECONDS = 18
WEEK = 604_800  # s


@ABILITIES.on("cyberdog.tof.data", needs=(TimeOfFlight,))
async def tof(session: Session) -> Record:
    """Current TofPayload (attribute): 64 distances per sensor, m, row by row from the top; 0: too near to measure."""
    head = {f"{side}_head": _single(session, f"head {side}") for side in ("left", "right")}
    rear = {f"{side}_rear": _single(session, f"rear {side}") for side in ("left", "right")}
    return Record("TofPayload", {"head": Record("HeadTofPayload", head), "rear": Record("RearTofPayload", rear)})


@ABILITIES.on("cyberdog.tof.get_data", needs=(TimeOfFlight,))
async def next_tof(session: Session, timeout: int = 5) -> Record:
    """Return the next TofPayload, or the last known one after ``timeout`` seconds."""
    part = session.robot[TimeOfFlight]
    if part.names:
        await newer(session, lambda: part.reading(part.names[0]).stamp, timeout)
    return await tof(session)


def _single(session: Session, name: str) -> Record:
    part = session.robot[TimeOfFlight]
    if name not in part.names:
        return Record("SingleTofPayload", {"tof_position": TOF_POSITIONS[name]})
    reading = part.reading(name)
    distances = np.nan_to_num(reading.distances, posinf=reading.range_max, neginf=0.0).astype(float)
    fields = {
        "header": header(epoch(session, reading.stamp), "tof"),
        "data_available": True,
        "tof_position": TOF_POSITIONS[name],
        "data": distances.ravel().tolist(),
    }
    return Record("SingleTofPayload", fields)


class EnabledRangeSensors:
    """Keeps the range sensors on while a program that reads them runs."""

    def __init__(self, session: Session) -> None:
        self._sensors = session.robot[RangeSensors]
        self._were_on = self._sensors.measuring

    def reading(self) -> RangeReading | None:
        """Return the newest reading; switch the sensors on, as another program's end may have switched them off."""
        if not self._sensors.measuring:
            self._sensors.measure(True)
        return self._sensors.reading(ULTRASONIC)

    def close(self) -> None:
        """Restore the sensors' earlier switch."""
        if not self._were_on:
            self._sensors.measure(False)


@ABILITIES.on("cyberdog.ultrasonic.data", needs=(RangeSensors,))
async def ultrasonic(session: Session) -> Record:
    """Current Range (attribute), m; inf without an echo; the defaults before the first measurement."""
    reading = session.part(EnabledRangeSensors).reading()
    if reading is None:
        return Record("Range")
    return Record(
        "Range",
        {
            "header": header(epoch(session, reading.stamp), ULTRASONIC),
            "radiation_type": ULTRASOUND,
            "field_of_view": reading.field_of_view,
            "min_range": reading.range_min,
            "max_range": reading.range_max,
            "range": reading.distance,
        },
    )


@ABILITIES.on("cyberdog.ultrasonic.get_data", needs=(RangeSensors,))
async def next_ultrasonic(session: Session, timeout: int = 5) -> Record:
    """Return the next Range, or the last known one after ``timeout`` seconds."""
    ranges = session.part(EnabledRangeSensors)

    def stamp() -> float:
        reading = ranges.reading()
        return reading.stamp if reading else -1.0

    await newer(session, stamp, timeout)
    return await ultrasonic(session)


@ABILITIES.on("cyberdog.gps.data", needs=(Gps,))
async def gps(session: Session) -> Record:
    """Current GpsPayload (attribute), degrees; without a fix (fix_type 0), those of the last fix, or 0."""
    reading = session.robot[Gps].reading
    at = epoch(session, reading.stamp)
    return Record(
        "GpsPayload",
        {
            "sec": int(at),
            "nanosec": round((at - int(at)) * 1e9) % 10**9,
            "itow": round((at - GPS_EPOCH + LEAP_SECONDS) % WEEK * 1000),
            "fix_type": int(reading.fix),
            "num_sv": reading.satellites,
            "lon": reading.longitude,
            "lat": reading.latitude,
        },
    )


@ABILITIES.on("cyberdog.gps.get_data", needs=(Gps,))
async def next_gps(session: Session, timeout: int = 5) -> Record:
    """Return the next GpsPayload, or the last known one after ``timeout`` seconds."""
    part = session.robot[Gps]
    await newer(session, lambda: part.reading.stamp, timeout)
    return await gps(session)
