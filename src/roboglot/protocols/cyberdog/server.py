"""The door: the gRPC server on 50052, TLS on both ends, and everything that lives as long as it is open."""

from __future__ import annotations

import asyncio
import contextlib
import shlex
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import grpc

from roboglot.config import is_loopback
from roboglot.model.admission import Right
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.legs import Legs, Posture
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import RobotError
from roboglot.model.events import BatteryChanged, LocalizationLost, LocalizationRecovered, MapReplaced
from roboglot.model.robot import Robot
from roboglot.protocols.cyberdog.app_link import AppLink, AppRoute, host_of
from roboglot.protocols.cyberdog.certificates import Certificates, CertificateStore
from roboglot.protocols.cyberdog.chapters.camera.camera_files import CameraFiles
from roboglot.protocols.cyberdog.chapters.camera.transfers import Transfers
from roboglot.protocols.cyberdog.chapters.camera.transmission import Transmission
from roboglot.protocols.cyberdog.chapters.mapping.reports import MapReports
from roboglot.protocols.cyberdog.chapters.mapping.task_state import Tasks
from roboglot.protocols.cyberdog.chapters.motion.gait import Gaits
from roboglot.protocols.cyberdog.chapters.motion.motion_start import SOURCE
from roboglot.protocols.cyberdog.chapters.motion.stairs import call_off
from roboglot.protocols.cyberdog.chapters.people.audio import ASK_VOICEPRINTS, TRAINED, activated
from roboglot.protocols.cyberdog.chapters.people.face_recognition import Faces
from roboglot.protocols.cyberdog.chapters.people.voice import Voice
from roboglot.protocols.cyberdog.chapters.programming import queue_to
from roboglot.protocols.cyberdog.chapters.system.bracelet import Bracelet
from roboglot.protocols.cyberdog.chapters.system.status import status_of, ticks
from roboglot.protocols.cyberdog.chapters.system.stored_settings import APP, kept
from roboglot.protocols.cyberdog.chapters.system.update_jobs import UpdateJobs
from roboglot.protocols.cyberdog.chapters.system.updates import Updates
from roboglot.protocols.cyberdog.config import CyberDogConfig
from roboglot.protocols.cyberdog.context import Context
from roboglot.protocols.cyberdog.handshakes import Handshakes
from roboglot.protocols.cyberdog.pem_files import FOLDER
from roboglot.protocols.cyberdog.profile import Profile
from roboglot.protocols.cyberdog.recorded_pushes import PlayedPushes
from roboglot.protocols.cyberdog.requests import add_calls
from roboglot.protocols.cyberdog.service import CALLS_MAX, HOST_CALLS_MAX, Service
from roboglot.protocols.cyberdog.table import TABLE
from roboglot.protocols.door import Endpoint
from roboglot.transport.grpc_wakeups import prompt_wakeups
from roboglot.transport.host_calls import HostCalls
from roboglot.wire.cyberdog.channel import ROBOT_NAME, server_options
from roboglot.wire.cyberdog.codes import MachineState
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb
from roboglot.wire.visual.relay import FrameRelay


class CyberDogDoor:
    """One robot as a CyberDog 2. ``people``, else ``data``, holds all robots' certificates; port 0 is any free one."""

    name = "cyberdog"

    def __init__(
        self,
        robot: Robot,
        address: str,
        config: CyberDogConfig,
        data: Path,
        frames: FrameRelay | None = None,
        people: Path | None = None,
    ) -> None:
        if config.plaintext and not is_loopback(address):
            raise ValueError(f"plaintext gRPC is allowed on loopback addresses only, not on {address}")
        self.port = config.port
        self._address = address
        self._config = config
        self._data, self._certificates = data, (people or data) / FOLDER
        self._robot = robot
        self._relay = frames
        self._server: grpc.aio.Server | None = None
        self._calls = HostCalls(host_of, HOST_CALLS_MAX)
        self._context: Context | None = None
        self._handshakes: Handshakes
        self._resting: asyncio.Task[None] | None = None
        self._writing: set[asyncio.Task[object]] = set()
        self._cleanup: list[Callable[[], None]] = []

    async def start(self) -> None:
        """Bind and listen, and dial the app if its address is configured."""
        certificates = None if self._config.plaintext else CertificateStore(self._certificates)
        self._context = self._assemble(certificates)
        with prompt_wakeups():
            self._server = server = grpc.aio.server(options=server_options(), maximum_concurrent_rpcs=CALLS_MAX)
        self._handshakes = Handshakes(self._address, self._config.port)
        self._cleanup.append(self._handshakes.close)
        service = Service(self._context, self._handshakes)
        self._cleanup.append(self._robot.admission.on_lost(service.cut_off))
        add_calls(server, service, self._calls, self._robot.clock.holding)
        if self._config.reflection:
            from roboglot.protocols.cyberdog.reflection import add_reflection

            add_reflection(self._server)
        self.port = self._bind(server, certificates)
        self._handshakes.port = self.port
        await self._server.start()
        self._context.app.start()

    async def close(self) -> None:
        """Stop listening, end all streams and the actions that they commanded."""
        while self._cleanup:
            self._cleanup.pop()()
        if self._resting:
            self._resting.cancel()
        if self._server:
            await self._server.stop(None)
        if self._context:
            call_off(self._robot, "the door closes", SOURCE)
            await self._context.close()
        await asyncio.gather(*self._writing, return_exceptions=True)

    @property
    def endpoints(self) -> Sequence[Endpoint]:
        """The gRPC server."""
        where = f"{self._address}:{self.port}"
        tls = self._certificates / "tls"
        words = ["grpcurl", "-plaintext"]
        if not self._config.plaintext:
            proof = (
                "-cacert",
                f"{tls}/ca-cert.pem",
                "-cert",
                f"{tls}/client-cert.pem",
                "-key",
                f"{tls}/client-key.pem",
            )
            words[1:] = [*proof, "-authority", ROBOT_NAME]
        words += ["-import-path", str(Path(pb.__file__).parent), "-proto", "cyberdog_app.proto"]
        words += ["-d", '{"nameCode": 10001, "params": "{}"}', where, "grpcapi.GrpcApp/sendMsg"]
        line = shlex.join(words)  # paths may contain spaces
        return [Endpoint("CyberDog 2 gRPC", where, line, None if self._config.plaintext else tls)]

    def _assemble(self, certificates: CertificateStore | None) -> Context:
        """Make the parts of the door and wire them."""
        robot = self._robot
        app = AppLink(
            robot.clock,
            partial(_as_client, certificates) if certificates else None,
            AppRoute(
                self._address,
                self._config.app,
                self._config.app_port,
                last=str(kept(robot, APP, "")),
                pace=lambda: robot.fairness.wait_to_dial() if robot.fairness and certificates else 0.0,
                unasked=Legs in robot or Base not in robot,  # a program's other bodies have no app until one calls
            ),
            ticks=lambda own: ticks(context, own),
            tap=robot.tap,
            inputs=robot.inputs,
            on_host=self._keep_app,
        )
        context = self._parts(app)
        reports = context.reports
        context.tasks.on_change.append(reports.follow)
        app.on_lost += [context.tasks.unbind, context.jobs.unbind, reports.forget_app, lambda: _leave_stairs(robot)]
        app.on_found.append(_once(lambda: _greet(context)))
        self._cleanup.append(robot.events.listen(BatteryChanged, lambda _: self._rest_if_empty(context)))
        self._cleanup.append(robot.admission.on_lost(lambda who: app.forget() if who == context.owner else None))
        self._cleanup.append(robot.admission.on_lost(context.video.end_all_of))
        listen, tasks = robot.events.listen, context.tasks
        self._cleanup += [
            listen(MapReplaced, lambda _: context.map_replaced()),
            listen(LocalizationLost, lambda event: tasks.lose_place(event.reason)),
            listen(LocalizationRecovered, lambda _: tasks.find_place()),
        ]
        if robot.responder is not None:
            played = context.played = PlayedPushes(robot.responder, app, robot.clock, self.name)
            self._cleanup += [played.close, robot.responder.join(self.name, played.put, _reads())]
        if self._relay:
            context.frames = queue_to(app, robot.clock)
            self._cleanup += [context.frames.close, self._relay.attach(context.frames)]
        return context

    def _parts(self, app: AppLink) -> Context:
        """Return the state of the chapters."""
        robot, gaits, updates = self._robot, Gaits(self._robot), Updates(self._robot, app)
        files = CameraFiles(robot, self._data / FOLDER / "camera" / robot.id)
        voice = Voice(robot, gaits, lambda code, id: app.push(TRAINED, {"code": code, "voiceprint_id": id}))
        voice.adapt()
        app.on_found.append(lambda: app.push(ASK_VOICEPRINTS, {}) if activated(robot) else None)
        return Context(
            robot=robot,
            app=app,
            gaits=gaits,
            tasks=Tasks(),
            reports=MapReports(robot, app),
            voice=voice,
            faces=Faces(robot, app),
            bracelet=Bracelet(robot, app),
            updates=updates,
            jobs=UpdateJobs(robot, updates),
            files=files,
            transfers=Transfers(robot, files, app),
            video=Transmission(robot, app),
            address=self._address,
            relay=self._relay,
            profile=Profile(self._config.profile),
        )

    def _keep_app(self, host: str) -> None:
        """Remember the app across restarts: an update reports its result then without a request."""
        if Settings in self._robot:
            task = asyncio.get_running_loop().create_task(self._robot[Settings].keep(APP, host), name="keep the app")
            self._writing.add(task)
            task.add_done_callback(self._writing.discard)

    def _rest_if_empty(self, context: Context) -> None:
        """Stop the task under way in low power."""
        if (
            context.gaits.state is MachineState.LOW_POWER
            and context.tasks.current
            and not context.tasks.current.stopping
        ):
            self._resting = asyncio.get_running_loop().create_task(context.tasks.stop())

    def _bind(self, server: grpc.aio.Server, certificates: CertificateStore | None) -> int:
        where = f"[{self._address}]" if ":" in self._address else self._address
        where = f"{where}:{self._config.port}"
        try:
            if certificates is None:
                port = server.add_insecure_port(where)
            else:
                port = server.add_secure_port(where, _as_server(certificates, self._handshakes))
        except RuntimeError:
            port = 0
        if not port:
            raise OSError(f"cannot listen on {where}: it is in use, or not an address of this machine")
        return int(port)


def _reads() -> set[str]:
    """Return the requests that change nothing."""
    return {str(int(operation.key)) for operation in TABLE if operation.right is Right.SEE}


def _as_client(store: CertificateStore) -> object:
    """Return the robot's credentials as a client of the app."""
    proof = store.newest()
    return grpc.ssl_channel_credentials(proof.callers, proof.key, proof.certificate)


def _as_server(store: CertificateStore, handshakes: Handshakes) -> object:
    """Return the server's credentials; certificates are read again at every connection."""

    def configured(proof: Certificates) -> object:
        return grpc.ssl_server_certificate_configuration(((proof.key, proof.certificate),), proof.callers)

    used = store.newest()

    def changed() -> object:
        nonlocal used
        handshakes.begun()
        before, used = used, store.newest()
        return None if used is before else configured(used)

    return grpc.dynamic_ssl_server_credentials(configured(used), changed, require_client_authentication=True)


def _once(action: Callable[[], None]) -> Callable[[], None]:
    """Return a function that calls ``action`` once, on its first call."""
    left = [action]
    return lambda: left.pop()() if left else None


def _greet(context: Context) -> None:
    """Let a lying dog stand up when its app connects for the first time, unless it charges by cable."""
    robot = context.robot
    if Legs in robot and robot[Legs].posture is Posture.LYING and not status_of(context).wired_charging:
        with contextlib.suppress(RobotError):  # it gets up on the next command
            robot[Legs].stand(source=SOURCE)


def _leave_stairs(robot: Robot) -> None:
    """Stop the alignment with stairs, as no client is left to do so; actions of other clients continue."""
    call_off(robot, "the app is lost", SOURCE)
