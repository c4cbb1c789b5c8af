import os
body = b'{"t":"call","id":1' + b"0" * 5000 + b',"name":"cyberdog.echo","args":[],"kwargs":{}}'
os.write(3, len(body).to_bytes(4, "big") + body)
print(os.read(3, 100))
