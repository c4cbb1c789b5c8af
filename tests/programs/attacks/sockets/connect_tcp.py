import socket
s = socket.create_connection(("127.0.0.1", {port}))
s.send(b"x")
print("ESCAPED")
