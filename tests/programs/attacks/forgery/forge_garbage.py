import os
os.write(3, b"\0\0\0\x05hello")
while True:
    pass
