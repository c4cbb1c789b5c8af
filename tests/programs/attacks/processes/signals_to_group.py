import os, signal
for target in (0, -1, {host}):
    try:
        os.kill(target, signal.SIGTERM)
        print("ESCAPED", target)
    except OSError as error:
        print(error)
