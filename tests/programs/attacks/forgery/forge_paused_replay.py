import os
for body in (b'{"t":"replayed","name":"cyberdog.echo"}', b'{"t":"value","value":"ESCAPED"}'):
    os.write(3, len(body).to_bytes(4, "big") + body)
print(os.read(3, 100))
