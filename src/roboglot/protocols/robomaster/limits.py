"""All limits of this door. A client beyond a limit is refused or disconnected, without effect on others."""

CONTROL_CONNECTIONS_MAX = 32
EVENT_CONNECTIONS_MAX = 32
EVENT_BACKLOG_MAX = 64 * 1024  # unread bytes of events per reader
MEDIA_CONNECTIONS_MAX = 16  # per stream
MEDIA_BACKLOG_MAX = 256 * 1024  # bytes of a stream queued for a slow viewer before packets are dropped
COMMANDS_MAX = 1024  # unanswered commands of one connection; beyond this, reading pauses until half are answered
LINES_MAX = 128  # lines of a session whose answers are known
LEFT_PERIOD = 0.1  # s between two checks whether a client whose reading is paused has hung up
OUTPUT_MAX = 64 * 1024  # unread bytes of replies per client; beyond this its next commands wait
BATCH_MAX = 64  # consecutive commands of one connection before others are served
EXPLANATIONS_MAX = 100  # refusals explained in the log per connection
UNFINISHED_AFTER = 2.0  # s after which a text without its `;` is explained in the log
TEXT_SHOWN_MAX = 120  # characters of a client's text shown in the log
WAIT_MAX = 60.0  # s of robot time that wait_for_complete waits
TARGETS_MAX = 20  # people, markers … per datagram
KEYS_MAX = 3  # pressed keys per datagram
DEAD_CLIENT_PROBES = (1, 1, 4)  # s of silence before a probe, s between probes, lost probes that end the connection
WATCH_PERIOD = 0.075  # s between two checks of a client whose motion is running
WATCH_MISSES_MAX = 4  # checks in a row without the requested answer before its motion stops
PILOTS_MAX = 4  # connections that act as pilot
PILOT_LINE_MAX = 1024  # bytes of a pilot's line, and of its unread answers
