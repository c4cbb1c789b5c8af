import os
body = b'{"t":"call","id":-1,"name":"cyberdog.echo","args":["x"],"kwargs":{}}'
os.write(3, len(body).to_bytes(4, "big") + body)
print(os.read(3, 100))
cyberdog.echo(1)
