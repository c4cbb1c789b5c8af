"""The door: connects to the MQTT broker, again and again; receives messages and sends the robot's."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import ssl
from collections.abc import AsyncIterator, Awaitable, Mapping, Sequence
from typing import Any

import msgspec

from roboglot.extras import explaining
from roboglot.model.admission import Unknown
from roboglot.model.client_context import set_client
from roboglot.model.components.energy.power import Power, PowerMode
from roboglot.model.robot import Robot
from roboglot.protocols.door import Endpoint
from roboglot.protocols.turns import Turns
from roboglot.protocols.vda5050 import vocabulary
from roboglot.protocols.vda5050.config import Vda5050Config
from roboglot.protocols.vda5050.context import Context
from roboglot.protocols.vda5050.dispatch import answer
from roboglot.protocols.vda5050.error_book import Error
from roboglot.protocols.vda5050.intake import Intake, stops
from roboglot.transport.log_limiter import LogLimiter
from roboglot.wire.vda5050.versions import VERSIONS

log = logging.getLogger(__name__)
RETRY = 2.0  # s between two attempts to connect
LOOK_PERIOD = 0.2  # s of robot time between two checks for changes of the state
STATE_PERIOD = 30.0  # s after which the state is sent even if unchanged
LINK_SECONDS = 5.0  # for an answer from the broker
TIMED_OUT = "Operation timed out"  # in aiomqtt's error
KEEPALIVE = 15  # s after which the broker reports that the robot is gone
CLOSING = 1.0  # s to disconnect from the broker


HEARD = {"v2": ("order", "instantActions"), "v3": ("order", "instantActions", "zoneSet", "responses")}  # topics


class SwitchedOff(Exception):
    """Robot was switched off; the door connects again when it is on."""


class Vda5050Door:
    """One robot at one broker; with no broker it is closed."""

    name = vocabulary.DOOR

    def __init__(self, robot: Robot, config: Vda5050Config) -> None:
        self._robot, self._config = robot, config
        self._version = VERSIONS[config.version]
        self._serial = config.serials.get(robot.id) or _level(robot.description.serial or robot.id)
        self._context = Context(robot, self._version, config.map, self._send_factsheet)
        self._headers: dict[str, int] = {}
        self._task: asyncio.Task[None] | None = None
        self._client: Any = None
        self._library = LastError()
        self._turns = Turns(robot, f"{self.name} {robot.id}:broker")
        self._log_limiter = LogLimiter(log)
        self._sent: object = None  # the last state sent, rounded, and when (robot time)
        self._sent_at = 0.0
        self._sheet: object = None  # the last factsheet sent
        self._rests = False  # hibernation was announced

    @property
    def endpoints(self) -> Sequence[Endpoint]:
        """The topics at the broker."""
        if not self._config.broker:
            return ()
        config, (host, port) = self._config, self._config.address
        certificates = f" --cafile {config.ca}" if config.ca else " --capath /etc/ssl/certs"
        options = certificates * config.tls + f" -u {config.username} -P PASSWORD" * bool(config.username)
        listen = f"mosquitto_sub -h {host} -p {port}{options} -v -t '{self._topic('#')}'"
        return [Endpoint("VDA 5050", f"mqtt{'s' * config.tls}://{host}:{port}/{self._topic('')}", listen)]

    def _topic(self, name: str) -> str:
        config = self._config
        return f"{config.interface}/{self._version.level}/{_level(config.manufacturer)}/{self._serial}/{name}"

    async def start(self) -> None:
        """Begin to connect. Raises MissingExtra without aiomqtt, OSError for certificates that cannot be read."""
        if self._config.broker:
            with explaining("the VDA 5050 door", "vda5050"):
                import aiomqtt  # noqa: F401 - said now rather than at the first try
            _tls(self._config)  # refused now rather than at each try
            self._task = asyncio.get_running_loop().create_task(self._dial())
            self._context.run_beside(self._context.maps.follow())

    async def close(self) -> None:
        """Send OFFLINE, and stop everything that fleet control began."""
        await self._context.close()
        if self._client is not None:
            with contextlib.suppress(Exception):
                async with asyncio.timeout(CLOSING):  # noqa: TID251 - the broker's time, not the robot's
                    await self._send_connection("OFFLINE")
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)

    async def _dial(self) -> None:
        import aiomqtt

        host, port = self._config.address
        while True:
            try:
                await self._serve(host, port)
            except (aiomqtt.MqttError, OSError) as error:
                why = self._unanswered() if str(error) == TIMED_OUT and self._client is None else error
                self._log_limiter.warning(
                    "dial", "robot %s: no fleet control at %s:%d: %s", self._robot.id, host, port, why
                )
            except SwitchedOff:
                log.info("robot %s leaves fleet control: it is switched off", self._robot.id)
            finally:
                self._client = None
            while self._is_off:  # noqa: ASYNC110 - seldom, and no event says so of every robot
                await asyncio.sleep(LOOK_PERIOD)  # noqa: TID251 - the broker's time, not the robot's
            await asyncio.sleep(RETRY)  # noqa: TID251 - the broker's time, not the robot's

    def _unanswered(self) -> str:
        """Return why no broker has answered, in more words than the library's exception has."""
        why = f": {self._library.last}" if self._library.last else ""
        hint = "" if self._config.tls else "; if it is a broker that encrypts, set tls = true"
        return f"it does not answer as a broker{why}{hint}"

    async def _serve(self, host: str, port: int) -> None:
        """Receive and send over one connection until it breaks."""
        import aiomqtt

        config, self._library = self._config, LastError()
        broken = "CONNECTION_BROKEN" if self._version.new_words else "CONNECTIONBROKEN"
        will = aiomqtt.Will(
            self._topic("connection"), self._message("connection", {"connectionState": broken}), 1, True
        )
        async with aiomqtt.Client(
            host,
            port,
            username=config.username or None,
            password=config.password or None,
            will=will,
            keepalive=KEEPALIVE,
            timeout=LINK_SECONDS,
            tls_context=_tls(config),
            queue_type=Intake,
            logger=self._library.logger,
        ) as client:
            self._client = client
            await self._introduce(f"{host}:{port}")
            for name in HEARD[self._version.level]:
                await client.subscribe(self._topic(name), qos=1)
            await self._send_connection("ONLINE")
            await self._send_factsheet()
            robot, version = self._robot.id, self._version.number
            log.info("robot %s: connected to the broker %s:%d, VDA 5050 %s", robot, host, port, version)
            self._sent = None
            self._rests = False
            await _until_one_ends(self._listen(Intake.of(client, self._turns.look)), self._report(), self._visualize())

    async def _listen(self, intake: Intake) -> None:
        async for message in self._client.messages:
            await self._turns.take(lambda: any(map(stops, (message, *intake.waiting))))  # noqa: B023 - used at once
            name = str(message.topic).rpartition("/")[2]
            await self._turns.count(answer(self._context, name, message.payload, retained=message.retain))

    async def _introduce(self, address: str) -> None:
        """Act for the fleet control behind this broker from here on."""
        who = ""
        with contextlib.suppress(Unknown):
            who = await self._robot.admission.admit(address)
        set_client(f"{self.name} {address.rpartition(':')[0]}", address, who)

    async def _report(self) -> None:
        """Send the state after each change and periodically."""
        async for now in self._robot.clock.every(LOOK_PERIOD):
            if self._rests and self._context.hibernation.on:
                continue
            async with self._surviving("state"):
                await self._report_at(now)
            if self._context.leaving or self._is_off:
                self._context.leaving = False
                await self._send_connection("OFFLINE")
                raise SwitchedOff

    async def _report_at(self, now: float) -> None:
        context = self._context
        if self._rests:
            self._rests = False
            await self._send_connection("ONLINE")
        await context.maps.look()
        if self._sheet != self._factsheet():
            await self._send_factsheet()
        state = self._state()
        if context.changed.is_set() or self._sent != _coarse(state) or now - self._sent_at >= STATE_PERIOD:
            context.changed.clear()
            self._sent, self._sent_at = _coarse(state), now
            await self._send("state", state)
        if context.hibernation.on:
            self._rests = True
            await self._send_connection("HIBERNATING")

    async def _visualize(self) -> None:
        async for _ in self._robot.clock.every(self._config.visualization_period):
            if self._rests:
                continue
            async with self._surviving("visualization"):
                place = vocabulary.position(self._robot, self._version, self._context.map_id)
                refers = (
                    {"referenceStateHeaderId": self._headers.get("state", 1) - 1} if self._version.new_words else {}
                )
                await self._send("visualization", refers | place | vocabulary.velocity(self._robot))

    @contextlib.asynccontextmanager
    async def _surviving(self, name: str) -> AsyncIterator[None]:
        """Log an unexpected error of one message and go on with the next; a broken link ends the connection instead."""
        import aiomqtt

        try:
            yield
        except (aiomqtt.MqttError, OSError):
            raise
        except Exception:  # noqa: BLE001 - it is logged, with its traceback
            self._log_limiter.error(name, "robot %s: sending %s to fleet control crashed", self._robot.id, name)

    @property
    def _is_off(self) -> bool:
        return Power in self._robot and self._robot[Power].mode is PowerMode.OFF

    def _state(self) -> dict[str, object]:
        """Return the state message's fields."""
        robot, context, version = self._robot, self._context, self._version
        own = vocabulary.action_states(context.book.actions.values(), version)
        instant = vocabulary.action_states(context.instant.values(), version)
        return {
            **vocabulary.progress(context.book),
            **vocabulary.position(robot, version, self._context.map_id),
            **vocabulary.velocity(robot),
            **vocabulary.loads(robot, context.load),
            **context.maps.listed(),
            "driving": vocabulary.is_driving(robot),
            "paused": context.paused,
            "newBaseRequest": context.needs_base,
            **(
                {"actionStates": own, "instantActionStates": instant}
                if version.new_words
                else {"actionStates": [*own, *instant]}
            ),
            **vocabulary.power(robot, version),
            "operatingMode": vocabulary.operating_mode(robot),
            "errors": [self._error(error) for error in context.errors],
            "information": [],
            **vocabulary.safety(robot, version),
        }

    def _error(self, error: Error) -> dict[str, object]:
        references = [{"referenceKey": key, "referenceValue": value} for key, value in error.references]
        return {
            "errorType": self._version.error(error.kind),
            "errorLevel": self._version.severity(error.level),
            "errorDescription": error.why,
            "errorReferences": references,
        }

    async def _send_connection(self, state: str) -> None:
        await self._send("connection", {"connectionState": state}, qos=1, retain=True)

    async def _send_factsheet(self) -> None:
        self._sheet = sheet = self._factsheet()
        await self._send("factsheet", sheet, qos=0, retain=True)

    def _factsheet(self) -> dict[str, object]:
        return vocabulary.factsheet(self._robot, self._version, STATE_PERIOD, self._config.visualization_period)

    def _message(self, name: str, values: Mapping[str, object]) -> bytes:
        """Return a message with its header."""
        number = self._headers.get(name, 0)
        self._headers[name] = number + 1
        header = {
            "headerId": number,
            "timestamp": vocabulary.timestamp(self._robot.clock.epoch()),
            "version": self._version.number,
            "manufacturer": self._config.manufacturer,
            "serialNumber": self._serial,
        }
        return msgspec.json.encode({**header, **values})

    async def _send(self, name: str, values: Mapping[str, object], qos: int = 0, retain: bool = False) -> None:
        if self._client is None:
            return
        data = self._message(name, values)
        if (tap := self._robot.tap).watched:
            tap.push(self.name, "broker", name, data)
        await self._client.publish(self._topic(name), data, qos=qos, retain=retain)


async def _until_one_ends(*jobs: Awaitable[None]) -> None:
    """Run all until the first ends, end the others, and raise the first one's error."""
    tasks = [asyncio.ensure_future(job) for job in jobs]
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        for task in done:
            task.result()
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


class LastError(logging.Handler):
    """Keeps the last error that the library has logged: it logs one at each try, often without a word of whose."""

    def __init__(self) -> None:
        super().__init__(logging.ERROR)
        self.last = ""
        self.logger = logging.Logger("mqtt")
        self.logger.addHandler(self)

    def emit(self, record: logging.LogRecord) -> None:
        """Keep the line."""
        self.last = record.getMessage()


def _tls(config: Vda5050Config) -> ssl.SSLContext | None:
    try:
        return ssl.create_default_context(cafile=config.ca or None) if config.tls else None
    except OSError as error:
        raise OSError(error.errno, f"vda5050.ca: {config.ca}: {error.strerror}") from None


def _level(text: str) -> str:
    """Return a text as a level of a topic."""
    return "".join("_" if sign in "/+#\0 " else sign for sign in text) or "_"


def _coarse(state: Mapping[str, Any]) -> dict[str, Any]:
    """Return the state without coordinates, speed and small changes of the charge, to detect changes."""
    fine = ("agvPosition", "mobileRobotPosition", "velocity", "powerSupply", "batteryState", "distanceSinceLastNode")
    battery = state.get("powerSupply") or state.get("batteryState") or {}
    charge = battery.get("stateOfCharge", battery.get("batteryCharge", 0.0))
    kept = {key: value for key, value in state.items() if key not in fine}
    place = state.get("mobileRobotPosition") or state.get("agvPosition") or {}
    kept |= {key: place.get(key) for key in ("localized", "positionInitialized", "mapId")}
    return kept | {"charging": battery.get("charging"), "charge": int(charge)}
