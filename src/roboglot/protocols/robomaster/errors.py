"""The one translation of the model's errors to the EP's answers."""

from roboglot.model.errors import RobotError
from roboglot.wire.robomaster.replies import Reply

# The text protocol has one answer for well-formed commands that cannot be done; the log gives the reason.
REPLIES: dict[type[RobotError], Reply] = {RobotError: Reply.FAIL}


def reply_to(error: RobotError) -> Reply:
    """Return the answer for ``error`` or its nearest ancestor in the table."""
    return next(REPLIES[kind] for kind in type(error).__mro__ if kind in REPLIES)
