import os, json
for i in range(10 ** 6):
    body = json.dumps({"t": "call", "id": i, "name": "cyberdog.echo", "args": [], "kwargs": {}}).encode()
    os.write(3, len(body).to_bytes(4, "big") + body)
