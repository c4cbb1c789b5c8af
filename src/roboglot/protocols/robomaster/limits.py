"""Every bound of this door in one place. Beyond a bound a client is refused or cut off; others don't notice."""

CONTROL_CONNECTIONS_MAX = 32
EVENT_CONNECTIONS_MAX = 32
EVENT_BACKLOG_MAX = 64 * 1024  # bytes of events that a reader may leave unread
MEDIA_CONNECTIONS_MAX = 16  # of each stream
MEDIA_BACKLOG_MAX = 256 * 1024  # bytes of a stream that wait for a slow viewer before packets are left out
COMMANDS_MAX = 1024  # unanswered commands of one connection; then no more is read until half of them are answered
LEFT_PERIOD = 0.1  # s between two looks whether a client that is not read from has hung up
OUTPUT_MAX = 64 * 1024  # bytes of replies a client may leave unread; then its next commands wait
BATCH_MAX = 64  # commands of one connection in a row before others get their turn
EXPLANATIONS_MAX = 100  # refusals explained in the log per connection
TEXT_SHOWN_MAX = 120  # characters of a client's text shown in the log
WAIT_MAX = 60.0  # s of robot time that wait_for_complete waits
TARGETS_MAX = 20  # people, markers … in one datagram
KEYS_MAX = 3  # pressed keys in one datagram
DEAD_CLIENT_PROBES = (1, 1, 4)  # s of silence before a probe, s between probes, unanswered probes that end it
VIGIL_PERIOD = 0.075  # s between two looks after a client whose motion runs
VIGIL_MISSES_MAX = 4  # looks in a row without an answer that was asked for; then its motion stops
PILOTS_MAX = 4  # connections that play the pilot
PILOT_LINE_MAX = 1024  # bytes of a pilot's line, and of answers that it leaves unread
