"""Limits of the console. Input is treated as hostile: each length, rate and count is limited."""

VIEWERS_MAX = 32  # open pages
MESSAGE_MAX = 64 * 1024  # bytes per message from a page
BODY_MAX = 256 * 1024  # bytes per request body
BODY_SECONDS_MAX = 30.0  # s (machine clock) for it to arrive
MESSAGES_PER_SECOND_MAX = 100  # from one page
NAME_MAX = 40  # characters of a person's name
JOIN_TRIES = 10  # wrong class codes per minute from one address
JOIN_BURST = 60  # wrong codes at once on pages: a whole class may return at the same moment
REQUESTS_MAX = 32  # commands of one page in progress
CALLS_MAX = 8  # pages that show live video by WebRTC
CALL_SECONDS = 20.0  # s for such a call to connect
REVOKED_SECONDS = 0.5  # between two checks whether a page's session lasts, and a caller may still see the robot
COMPARE_SECONDS = 300.0  # s for a comparison of two recordings
COMPARE_MEMORY = 2 << 30  # bytes of its data
DOWNLOAD_BYTES = 1 << 20  # of a recording, sent at once
OFFER_MAX = 64 * 1024  # characters in a page's call offer
JPEG_QUALITY = 75
THUMBNAIL_SIDE = 96  # pixels along the longer side of a map in the grid of robots
PORTS_TRIED_MAX = 20  # further ports that are tried if the first is taken

BEAT = 0.1  # s between two updates of poses and scans
BEAT_PAGES = 10  # pages that get a moving robot's updates at each beat; with more, they take turns
STATE_BEATS = 2  # beats between two updates of the state of the robot that a page shows
OTHERS_BEATS = 10  # beats for all other robots
MAP_SECONDS = 1.0  # minimum between two maps
DEAD_MAN = 0.3  # s of silence after which the robot brakes
STALE = 0.25  # s: older velocities are ignored

WIRE_SECONDS = 600.0  # s for which exchanges are kept
WIRE_MAX = 20_000  # exchanges kept
WIRE_BYTES_MAX = 16 * 1024 * 1024  # of payload per direction
PAYLOAD_MAX = 64 * 1024  # bytes kept of one payload
RESEND_SECONDS = 20.0  # s for the answer to a request that is sent again
RESENDS_MAX = 16  # such connections at the same time
RESEND_HOLD = 10.0  # s for which its connection stays open, so that the action it started continues
EXCERPT_MAX = 2_000  # characters of a payload shown in a list
BATCH_MAX = 200  # exchanges per message to a page
