import os
for pid in (os.getppid(), 1, -1, 0, {host}):
    try:
        os.kill(pid, 9)
        print("ESCAPED")
    except OSError:
        pass
