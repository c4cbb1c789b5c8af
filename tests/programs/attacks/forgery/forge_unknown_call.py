import os, json
body = json.dumps({"t": "call", "id": 1, "name": "os.system", "args": ["touch {target}"], "kwargs": {}}).encode()
os.write(3, len(body).to_bytes(4, "big") + body)
print(os.read(3, 100))
