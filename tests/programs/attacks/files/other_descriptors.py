import os
for fd in list(range(3)) + list(range(4, 300)):
    for action in (lambda: os.read(fd, 100), lambda: os.write(fd, b"x"), lambda: os.fstat(fd), lambda: os.dup(fd)):
        try:
            print("ESCAPED", fd, action())
        except OSError:
            pass
