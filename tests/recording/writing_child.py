"""Writes a value every millisecond until it is killed: for the test that kills it."""

import sys
import time
from pathlib import Path

from roboglot.recording.entries import Entry
from roboglot.recording.files import Files, Limits, Origin
from roboglot.recording.redaction import Redaction
from roboglot.recording.thread import WriterThread


def main() -> None:
    files = Files(Path(sys.argv[1]), Origin({"version": "0"}), Redaction(), Limits())
    files.open(time.time_ns())
    thread = WriterThread(files)
    print("writing", flush=True)
    number = 0
    while True:
        number += 1
        now = time.time_ns()
        thread.put(Entry("/a/events", "event", now, now, {"event": "Tick", "number": number}))
        time.sleep(0.001)


if __name__ == "__main__":
    main()
