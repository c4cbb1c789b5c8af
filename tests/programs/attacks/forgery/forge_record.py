import os
body = b'{"t":"call","id":1,"name":"cyberdog.echo","args":[{"$":"dict","v":[[[[]],1]]}],"kwargs":{}}'
os.write(3, len(body).to_bytes(4, "big") + body)
while True:
    pass
