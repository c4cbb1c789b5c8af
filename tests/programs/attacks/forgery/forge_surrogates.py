import os
body = b'{"t":"output","text":"\\ud800\\udfff"}'
os.write(3, len(body).to_bytes(4, "big") + body)
print("\ud800")
