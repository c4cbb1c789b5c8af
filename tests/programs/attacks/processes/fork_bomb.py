import os
for _ in range(2000):
    try:
        os.fork()
        print("ESCAPED")
    except OSError:
        pass
