import os
body = b'{"t":"finished"}'
os.write(3, len(body).to_bytes(4, "big") + body)
while True:
    pass
