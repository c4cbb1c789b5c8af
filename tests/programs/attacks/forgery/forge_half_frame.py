import os
os.write(3, b"\0\0\1\0{")
while True:
    pass
