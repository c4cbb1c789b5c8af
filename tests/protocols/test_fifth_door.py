"""A further door is a ``DoorType``: the program opens, configures and closes it like the four."""

from __future__ import annotations

import asyncio
import dataclasses
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest

from roboglot.cli.coverage import measure
from roboglot.config import RobotConfig, load_config
from roboglot.model.components.energy.battery import Battery
from roboglot.operations import OperationTable, Right
from roboglot.protocols import DOORS, sections
from roboglot.protocols.door import Contract, DoorType, Endpoint, PortSetting, Site
from roboglot.runtime import Runtime
from roboglot.testing.addresses import free_addresses
from roboglot.wire.contracts import Row

ADDRESS = free_addresses(1)
TABLE: OperationTable[str] = OperationTable("charge")


@dataclass(frozen=True)
class ChargeConfig:
    port: int = 0
    unit: str = "%"


class ChargeDoor:
    """Answers a line with what the table's operation of that name returns."""

    name = "charge"

    def __init__(self, config: ChargeConfig, site: Site) -> None:
        self.config, self.site = config, site

    async def start(self) -> None:
        self.server = await asyncio.start_server(self.serve, self.site.address, self.config.port)

    async def close(self) -> None:
        self.server.close()

    @property
    def endpoints(self) -> Sequence[Endpoint]:
        return [Endpoint("charge", f"{self.site.address}:{self.server.sockets[0].getsockname()[1]}")]

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        operation = TABLE.get((await reader.readline()).decode().strip())
        writer.write(f"{await operation.call(self, {}) if operation else 'unknown'}\n".encode())
        writer.close()


@TABLE.on("charge", right=Right.SEE, needs=(Battery,))
async def get_charge(door: ChargeDoor) -> str:
    return f"{door.site.robot[Battery].state.percentage:.0%}{door.config.unit}"


class Done:
    def implemented(self) -> set[str]:
        return {operation.key for operation in TABLE}

    def partly(self) -> dict[str, str]:
        return {}


ROWS = (Row("charge", "energy", "Charge"), Row("drain", "energy", "Drain"))
DOOR = DoorType(
    name="charge",
    title="charge",
    config=ChargeConfig,
    contracts=(Contract("charge", lambda: ROWS, Done),),
    table=lambda: TABLE,
    ports=(PortSetting("charge", "port"),),
    open=ChargeDoor,
)


async def test_a_fifth_door_opens_with_its_section(tmp_path: Path) -> None:
    file = tmp_path / "robots.toml"
    file.write_text('[charge]\nunit = " full"\n')
    base = load_config(
        file, {"data": str(tmp_path / "data"), "world": "empty", "lockstep": True}, sections((*DOORS, DOOR))
    )
    runtime = Runtime(dataclasses.replace(base, robots=(RobotConfig("a", "universal", ADDRESS),)), (DOOR,))
    await runtime.start()
    try:
        (endpoint,) = runtime.doors["a"].endpoints
        host, _, port = endpoint.address.rpartition(":")
        reader, writer = await asyncio.open_connection(host, int(port))
        writer.write(b"charge\n")
        assert (await reader.readline()).endswith(b"% full\n")
        writer.close()
    finally:
        await runtime.close()


def test_its_mistaken_settings_are_named(tmp_path: Path) -> None:
    file = tmp_path / "robots.toml"
    file.write_text("[charge]\nunits = 1\n")
    with pytest.raises(ValueError, match=r"charge\.units is not a setting"):
        load_config(file, {}, sections((DOOR,)))


def test_its_coverage_is_measured() -> None:
    assert measure(DOOR.contracts[0]).missing == ["drain"]


def test_describing_doors_loads_none_of_them() -> None:
    heavy = "{'grpc', 'uvicorn', 'av', 'numpy', 'roboglot.protocols.slamware.server'}"
    program = f"import sys, roboglot.protocols; print(sorted({heavy} & sys.modules.keys()))"
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert ended.stdout == "[]\n"


def test_the_readme_names_every_door() -> None:
    text = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    for door in DOORS:
        assert str(getattr(door.config(), door.ports[0].setting)) in text, door.name
