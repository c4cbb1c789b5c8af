"""Limits of the console. What comes from outside is hostile: each length, rate and count has an end."""

from __future__ import annotations

VIEWERS_MAX = 32  # open pages
MESSAGE_MAX = 64 * 1024  # bytes of one message of a page
BODY_MAX = 256 * 1024  # bytes of a request's body
MESSAGES_PER_SECOND_MAX = 100  # of one page
NAME_MAX = 40  # characters of a person's name
JOIN_TRIES = 10  # wrong codes of a class a minute, of one address
JOIN_BURST = 60  # of them at once on pages: a whole class may come back at the same moment
WISHES_MAX = 32  # commands of one page under way
CALLS_MAX = 8  # pages that show live video by WebRTC
CALL_SECONDS = 20.0  # in which such a call is connected
REVOKED_SECONDS = 0.5  # between two looks at whether a caller may still see the robot
OFFER_MAX = 64 * 1024  # characters of a page's offer of a call
JPEG_QUALITY = 75
THUMBNAIL_SIDE = 96  # pixels of the longer side of a map in the grid of robots
PORTS_TRIED_MAX = 20  # ports after the first that are tried when it is taken

BEAT = 0.1  # s between two poses and scans
BEAT_PAGES = 10  # pages that draw a moving robot at each beat; more take turns
STATE_BEATS = 2  # beats between two looks at the state of the robot that a page shows
OTHERS_BEATS = 10  # of all other robots
MAP_SECONDS = 1.0  # between two maps at least
DEAD_MAN = 0.3  # s of silence after which the robot brakes
STALE = 0.25  # s: an older velocity is ignored

WIRE_SECONDS = 600.0  # that exchanges are kept
WIRE_MAX = 20_000  # exchanges kept
WIRE_BYTES_MAX = 16 * 1024 * 1024  # of payload kept
PAYLOAD_MAX = 64 * 1024  # bytes kept of one payload
RESEND_SECONDS = 20.0  # in which a request that is sent again is answered
RESENDS_MAX = 16  # such connections at a time
RESEND_HOLD = 10.0  # s that its connection stays, so that what it began goes on
EXCERPT_MAX = 2_000  # characters of a payload that a list shows
BATCH_MAX = 200  # exchanges in one message to a page
