"""The program that scripts and agents run, one per robot: an ordinary task with its own id."""

from __future__ import annotations

from roboglot.console.desk import CLIENT, Desk
from roboglot.console.studio.programs import Programs
from roboglot.console.verbs.robots import stop
from roboglot.model.admission import Right
from roboglot.model.errors import NotFound
from roboglot.programs.stores import StoredProgram
from roboglot.programs.tasks import debugging

TASK = "console_script"
PROGRAM = "program"  # the kind of recorded inputs for such programs, and for all programs of a robot
END, DEBUG = "end", "debug"  # names of such inputs
SOURCE_MAX = 64 * 1024  # characters of a program
LINES_MAX = 200  # newest log lines in an answer


async def start(desk: Desk, name: str, source: str) -> dict[str, object]:
    """Save ``source`` and run it now; the former run must have ended. Raises NotFound, Forbidden, ProgramError."""
    programs = programs_of(desk, name, Right.PROGRAM)
    if not 0 < len(source) <= SOURCE_MAX:
        raise ValueError(f"a program has 1 to {SOURCE_MAX} characters")
    robot = desk.robots[name]
    with robot.admission.noting(CLIENT, "program"), robot.inputs.noting(PROGRAM, "run", {"source": source}):
        await programs.service.save(StoredProgram(TASK, "run by a script", "", "single", "now", source, ""))
        await programs.service.run(TASK)
    return await program(desk, name)


async def end_all(desk: Desk, name: str) -> None:
    """End every program and motion of a pupil's robot; the teacher's right has been checked.

    Raises NotFound, RobotError.
    """
    robot = desk.robots.get(name)
    if robot is None:
        raise NotFound(f"there is no robot {name!r}")
    with robot.admission.noting(CLIENT, "stop"), robot.inputs.noting(PROGRAM, END, {}):
        if (programs := desk.studio.programs.get(name)) is not None:
            await programs.end_all(why="ended by the teacher")
        await stop(robot)


async def debug(programs: Programs, text: str) -> str:
    """Return the answer of a robot's programs to a message of the debugger. Raises ProgramError."""
    with programs.robot.inputs.noting(PROGRAM, DEBUG, {"text": text}):
        return await debugging.answer(programs.service, text)


async def program(desk: Desk, name: str) -> dict[str, object]:
    """Return the program's state and the end of its log. Raises NotFound, Forbidden."""
    service = programs_of(desk, name, Right.SEE).service
    tasks = await service.tasks([TASK])
    log = await service.log(TASK) if tasks else []
    return {
        "state": str(tasks[0].state) if tasks else "none",
        "log": [{"level": entry.level, "text": entry.text} for entry in log[-LINES_MAX:]],
    }


def programs_of(desk: Desk, name: str, right: Right) -> Programs:
    """Return the robot's programs if the current client has the right on it. Raises NotFound, Forbidden."""
    robot = desk.view(name, "program").robot
    robot.admission.check(CLIENT, "program", right)
    if name not in desk.studio.programs:
        raise NotFound(f"robot {name} runs no block programs")
    return desk.studio.programs[name]
