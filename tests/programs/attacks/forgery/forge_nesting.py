import os
body = b'{"t":"call","id":1,"name":"cyberdog.echo","args":[' + b"[" * 100000 + b"]" * 100000 + b'],"kwargs":{}}'
body = len(body).to_bytes(4, "big") + body
while body:
    body = body[os.write(3, body):]
while True:
    pass
