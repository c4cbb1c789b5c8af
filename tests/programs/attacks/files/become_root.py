import os
for action in (lambda: os.setuid(0), lambda: os.setresuid(0, 0, 0), lambda: os.setgid(0), lambda: os.setns(3) if hasattr(os, "setns") else 1 / 0):
    try:
        action()
        print("ESCAPED")
    except (OSError, ZeroDivisionError):
        pass
