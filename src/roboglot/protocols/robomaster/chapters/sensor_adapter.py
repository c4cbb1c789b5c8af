"""The sensor adapter chapter (manual 3.2.10)."""

from __future__ import annotations

from roboglot.model.components.sensing.adapter import SensorAdapters
from roboglot.operations import Right
from roboglot.protocols.robomaster.context import Context
from roboglot.protocols.robomaster.event_switches import EventSwitches
from roboglot.protocols.robomaster.ranges import AdapterId, AdapterPort, OnOff
from roboglot.protocols.robomaster.table import TABLE
from roboglot.wire.robomaster.telemetry import RAW_MAX


@TABLE.on("sensor_adapter adc ?", right=Right.SEE, needs=(SensorAdapters,))
def get_voltage(context: Context, *, id: AdapterId, port: AdapterPort) -> tuple[float | int, ...]:
    """Return the voltage at the input, V (3.2.10.1); real robots: the converter's raw number."""
    adapters = context.robot[SensorAdapters]
    voltage = adapters.voltage(id, port)
    return (round(voltage / adapters.voltage_max * RAW_MAX) if context.profile.as_robots else round(voltage, 3),)


@TABLE.on("sensor_adapter io_level ?", right=Right.SEE, needs=(SensorAdapters,))
def get_level(context: Context, *, id: AdapterId, port: AdapterPort) -> tuple[int, ...]:
    """Return the logic level, 0 or 1 (3.2.10.2)."""
    return (int(context.robot[SensorAdapters].level(id, port)),)


@TABLE.on("sensor_adapter pulse_period", "sensor_adapter pulse_period ?", right=Right.SEE, needs=(SensorAdapters,))
def get_pulse_period(context: Context, *, id: AdapterId, port: AdapterPort) -> tuple[int, ...]:
    """Return ms between the last two changes of level (3.2.10.3). No ``?`` in the manual, but on real robots."""
    return (round(context.robot[SensorAdapters].pulse_period(id, port) * 1000),)


@TABLE.on("sensor_adapter event", right=Right.SEE, needs=(SensorAdapters,))
def switch_events(context: Context, *, io_level: OnOff) -> None:
    """Switch reports of level changes on the event port (3.2.10.4)."""
    context.part(EventSwitches).adapters(io_level == "on")
