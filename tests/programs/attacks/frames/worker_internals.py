import sys
from roboglot.programs.worker import zygote, lockdown
libc = lockdown.open_libc()
print(zygote.socket.socket(fileno=3).recvmsg(100))
print("ESCAPED")
