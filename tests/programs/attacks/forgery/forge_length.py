import os
os.write(3, b"\xff\xff\xff\xff" + b"x" * 100)
while True:
    pass
