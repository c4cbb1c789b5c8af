"""Values of ``feedback.state`` (0.2.1.2.2.1 of the manual). The shipped firmware's 80xx numbers are not used."""

from enum import IntEnum


class FeedbackState(IntEnum):
    """Result of an operation. 11..20 are reserved; the manual lists 31 twice."""

    OK = 0
    NOT_JSON = 1
    BAD_TYPE = 2
    BAD_ID = 3
    BAD_TARGET_ID = 4
    BAD_DESCRIBE = 5
    BAD_STYLE = 6
    BAD_OPERATE = 7
    BAD_MODE = 8
    BAD_CONDITION = 9
    BAD_BODY = 10
    CANNOT_CREATE_PATH = 21
    CANNOT_OPEN_FILE = 22
    BAD_SYNTAX = 23
    CANNOT_REGISTER = 24
    CANNOT_UPDATE_LIST = 25
    CANNOT_EXECUTE = 26
    ILLEGAL = 27
    BAD_REQUEST = 28
    OTHER = 29
    INTERRUPTED = 30
    TIMED_OUT = 31
