"""Errors of operations on a task or a module. Doors map these types to their protocol's own numbers."""


class ProgramError(Exception):
    """An operation was not done; the message gives the reason in words for the user."""


class NotAllowed(ProgramError):
    """The state of the task or module, the robot's mode, or a caller of the module forbids it."""


class LimitReached(ProgramError):
    """No room is left for another task or module."""


class InvalidCondition(ProgramError):
    """The condition does not fit the mode, or the interface of a module clashes with another name."""


class InvalidBody(ProgramError):
    """The source cannot be read as a program at all."""


class ProgramProblems(ProgramError):
    """The check found problems in the source; the message lists the first of them."""


class RecursiveModule(ProgramError):
    """The module would call itself through others."""


class ModuleGone(ProgramError):
    """A module that the program calls was deleted during the check."""


class CannotExecute(ProgramError):
    """The program could not be started, or it failed."""


class EngineTimeout(ProgramError):
    """The program engine did not answer in time."""


class EngineUnavailable(ProgramError):
    """The program engine is not working."""


class StoreError(Exception):
    """The store of programs failed: nothing was changed."""
