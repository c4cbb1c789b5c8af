import socket
s = socket.socket(fileno=3)
socket.send_fds(s, [b"x"], [3])
print("ESCAPED")
