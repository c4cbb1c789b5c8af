import ctypes
libc = ctypes.CDLL(None)
if libc.ptrace(16, {host}, 0, 0) == 0 or libc.ptrace(0, 0, 0, 0) == 0:
    print("ESCAPED")
