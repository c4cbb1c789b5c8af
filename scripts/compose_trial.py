"""Runs what a compose file says with buildah and this machine's PostgreSQL, and asks each service for something real.

Not docker: capabilities are not dropped, restart policies are not tried, and the database's image is not fetched; its
user, password and name are the file's. Called by scripts/compose in a network and mount namespace of its own.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.request
from pathlib import Path
from typing import Any

import psycopg
import yaml

BRIDGE = "10.89.0"
PATIENCE = 90.0  # s until a service is healthy
Service = dict[str, Any]


def sh(*command: str) -> str:
    """Run a command and return what it wrote."""
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()


def filled(value: Any) -> Any:
    """Return ``value`` with ${NAME:-default} filled in."""
    if isinstance(value, str):
        return re.sub(r"\$\{(\w+):-([^}]*)\}", lambda found: os.environ.get(found[1]) or found[2], value)
    if isinstance(value, dict):
        return {key: filled(one) for key, one in value.items()}
    return [filled(one) for one in value] if isinstance(value, list) else value


def ports_of(service: Service) -> list[tuple[str, int, int]]:
    """Return address and port outside, and port inside, of every port that is published."""
    found = []
    for text in service.get("ports", ()):
        address, outside, inside = text.split(":")
        first, _, last = outside.partition("-")
        start, _, end = inside.partition("-")
        count = int(last or first) - int(first)
        assert int(end or start) - int(start) == count, text
        found += [(address, int(first) + step, int(start) + step) for step in range(count + 1)]
    return found


def check(file: Path, compose: dict[str, Any]) -> None:
    """Raise AssertionError for what compose would refuse."""
    services, volumes = compose["services"], compose.get("volumes", {})
    taken = [(address, outside) for service in services.values() for address, outside, _ in ports_of(service)]
    assert len(taken) == len(set(taken)), "a port is published twice"
    assert all(address.startswith("127.") for address, _ in taken), "a port is published to everyone"
    for name, service in services.items():
        assert service.get("image"), f"{name} has no image"
        if build := service.get("build"):
            assert (file.parent / build["context"] / build["dockerfile"]).is_file(), f"{name}: no {build['dockerfile']}"
        assert set(service.get("depends_on", {})) <= set(services), f"{name} depends on what is not there"
        mounted = {volume.partition(":")[0] for volume in service.get("volumes", ())}
        assert mounted <= set(volumes), f"{name} mounts a volume that is not declared"


class Trial:
    """The services of one compose file."""

    def __init__(self, services: dict[str, Service], work: Path) -> None:
        self.services, self.work = services, work
        self.address = {name: f"{BRIDGE}.{number}" for number, name in enumerate(services, 10)}
        self.containers: list[str] = []
        self.running: list[subprocess.Popen[bytes]] = []

    def network(self) -> None:
        """Make a bridge, and a network namespace at it for each service."""
        Path("/run/netns").mkdir(exist_ok=True)
        sh("mount", "-t", "tmpfs", "tmpfs", "/run/netns")
        sh("ip", "link", "set", "lo", "up")
        sh("ip", "link", "add", "bridge0", "type", "bridge")
        sh("ip", "address", "add", f"{BRIDGE}.1/24", "dev", "bridge0")
        sh("ip", "link", "set", "bridge0", "up")
        for number, (name, address) in enumerate(self.address.items()):
            sh("ip", "netns", "add", name)
            sh("ip", "link", "add", f"v{number}", "type", "veth", "peer", "name", "eth0", "netns", name)
            sh("ip", "link", "set", f"v{number}", "master", "bridge0", "up")
            for inside in ("link set lo up", f"address add {address}/24 dev eth0", "link set eth0 up"):
                sh("ip", "-n", name, *inside.split())

    def start(self, name: str) -> None:
        """Start a service as the file has it."""
        service = self.services[name]
        log = (self.work / f"{name}.log").open("wb")
        run = self.database if "postgres" in service["image"] else self.container
        self.running.append(subprocess.Popen(run(name, service), stdout=log, stderr=log, start_new_session=True))

    def container(self, name: str, service: Service) -> list[str]:
        """Return what runs a service of our image: its entry point, as its user, with its data folder."""
        hosts = [f"--add-host={host}:{address}" for host, address in self.address.items()]
        container = sh("buildah", "from", "--pull-never", *hosts, service["image"])
        self.containers.append(container)
        about = json.loads(sh("buildah", "inspect", container))["Docker"]["config"]
        data = self.work / name
        data.mkdir()
        shutil.chown(data, 1000, 1000)
        command = service.get("command") or about["Cmd"]
        environment = [f"--env={key}={value}" for key, value in service.get("environment", {}).items()]
        volumes = [f"--volume={data}:/data"]
        inside = [*about["Entrypoint"], *command]
        print(f"  {name}: {shlex.join(inside)}")
        return ["ip", "netns", "exec", name, "buildah", "run", "--user=1000:1000", *environment, *volumes, container,
                "--", *inside]  # fmt: skip

    def database(self, name: str, service: Service) -> list[str]:
        """Return what runs PostgreSQL with the file's user, password and database."""
        about, data = service["environment"], self.work / name
        data.mkdir()
        shutil.chown(data, "nobody")
        password = self.work / "password"
        password.write_text(about["POSTGRES_PASSWORD"])
        password.chmod(0o644)
        as_nobody = ("setpriv", "--reuid=nobody", "--clear-groups")
        sh(
            *as_nobody,
            "initdb",
            "-D",
            str(data),
            "-U",
            about["POSTGRES_USER"],
            f"--pwfile={password}",
            "-A",
            "scram-sha-256",
        )
        with (data / "pg_hba.conf").open("a") as rules:
            rules.write(f"host all all {BRIDGE}.0/24 scram-sha-256\n")
        print(f"  {name}: PostgreSQL of this machine in place of {service['image']}")
        return ["ip", "netns", "exec", name, *as_nobody, "postgres", "-D", str(data), "-h", "*", "-k", str(data)]

    def until_healthy(self, name: str) -> None:
        """Wait until the service's health check passes. Raises AssertionError with what it wrote."""
        service, end = self.services[name], time.monotonic() + PATIENCE
        while not self.healthy(name, service):
            log = (self.work / f"{name}.log").read_text(errors="replace")
            assert time.monotonic() < end, f"{name} is not healthy: {log[-3000:]}"
            time.sleep(0.3)

    def healthy(self, name: str, service: Service) -> bool:
        """Do what the service's health check does."""
        if "postgres" in service["image"]:
            with contextlib.suppress(psycopg.OperationalError), self.connect(name):
                return True
            return False
        container = self.containers[
            [n for n in self.services if "postgres" not in self.services[n]["image"]].index(name)
        ]
        check = service.get("healthcheck", {}).get("test") or ["CMD", "python", "/opt/roboglot/health.py"]
        done = subprocess.run(["ip", "netns", "exec", name, "buildah", "run", container, "--", *check[1:]],
                              check=False, capture_output=True)  # fmt: skip
        return done.returncode == 0

    def connect(self, name: str) -> psycopg.Connection[Any]:
        """Connect to the database as the file's user."""
        about = self.services[name]["environment"]
        return psycopg.connect(host=self.address[name], user=about["POSTGRES_USER"], connect_timeout=2,
                               password=about["POSTGRES_PASSWORD"], dbname="postgres", autocommit=True)  # fmt: skip

    def close(self) -> None:
        """End what runs."""
        for process in self.running:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, 15)
        for process in self.running:
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(15)
        for container in self.containers:
            subprocess.run(["buildah", "rm", container], check=False, capture_output=True)


async def publish(trial: Trial) -> list[asyncio.Server]:
    """Listen where the file publishes ports, and pass on what comes."""

    async def pump(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with contextlib.suppress(OSError):
            while data := await reader.read(65536):
                writer.write(data)
                await writer.drain()
        writer.close()

    def forward(address: str, port: int) -> Any:
        async def take(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            try:
                there = await asyncio.open_connection(address, port)
            except OSError:
                writer.close()
                return
            await asyncio.gather(pump(reader, there[1]), pump(there[0], writer))

        return take

    return [
        await asyncio.start_server(forward(trial.address[name], inside), address, outside)
        for name, service in trial.services.items()
        for address, outside, inside in ports_of(service)
    ]


def ask(address: str, path: str, body: object = None) -> Any:
    """Ask a robot's REST door as its file publishes it."""
    data = None if body is None else json.dumps(body).encode()
    request = urllib.request.Request(f"http://{address}:1448{path}", data, {"content-type": "application/json"})
    with urllib.request.urlopen(request, timeout=20) as reply:
        return json.load(reply)


def use(trial: Trial) -> None:
    """Drive robot b, see that a stands, and that the cloud keeps what it has in the database."""
    pose = "/api/core/slam/v1/localization/pose"
    before = ask("127.0.0.1", pose)
    options = {"target": {"x": 0.5, "y": 0, "z": 0}, "move_options": {}}
    ask(
        "127.0.0.2",
        "/api/core/motion/v1/actions",
        {"action_name": "slamtec.agent.actions.MoveToAction", "options": options},
    )
    end = time.monotonic() + PATIENCE
    while ask("127.0.0.2", pose)["x"] < 0.4:
        assert time.monotonic() < end, "robot b did not drive"
        time.sleep(0.5)
    after = ask("127.0.0.1", pose)
    assert abs(after["x"] - before["x"]) < 0.02, "robot a drove, too"
    print(
        f"  robot-b drove to x = {ask('127.0.0.2', pose)['x']:.2f} over 127.0.0.2, robot-a stands at {after['x']:.2f}"
    )
    (database,) = (name for name, service in trial.services.items() if "postgres" in service["image"])
    about = trial.services[database]["environment"]
    with psycopg.connect(host=trial.address[database], user=about["POSTGRES_USER"], dbname=about["POSTGRES_DB"],
                         password=about["POSTGRES_PASSWORD"]) as link:  # fmt: skip
        row = link.execute("SELECT count(*) FROM information_schema.tables WHERE table_schema = 'public'").fetchone()
    tables = row[0] if row else 0
    assert tables > 0, "the cloud made no tables"
    print(f"  cloud keeps {tables} tables in the database")


async def run(services: dict[str, Service], work: Path) -> None:
    """Start in the order of depends_on, use, end."""
    trial = Trial(services, work)
    trial.network()
    try:
        waiting = sorted(trial.services, key=lambda name: bool(trial.services[name].get("depends_on")))
        for name in waiting:
            for needed in trial.services[name].get("depends_on", {}):
                trial.until_healthy(needed)
                with contextlib.suppress(psycopg.errors.DuplicateDatabase), trial.connect(needed) as link:
                    link.execute(f'CREATE DATABASE "{trial.services[needed]["environment"]["POSTGRES_DB"]}"')
            trial.start(name)
        began = time.monotonic()
        for name in waiting:
            await asyncio.to_thread(trial.until_healthy, name)
        print(f"  all healthy after {time.monotonic() - began:.1f} s")
        servers = await publish(trial)
        await asyncio.to_thread(use, trial)
        for server in servers:
            server.close()
    finally:
        trial.close()


def main(file: Path) -> None:
    """Check the file, and run it."""
    compose = filled(yaml.safe_load(file.read_text()))
    check(file, compose)
    print(f"{file}: valid, {len(compose['services'])} services")
    with tempfile.TemporaryDirectory() as folder:
        Path(folder).chmod(0o755)
        asyncio.run(run(compose["services"], Path(folder)))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
