import ctypes
libc = ctypes.CDLL(None)
if libc.kill({host}, 19) == 0 or libc.syscall(424, 3, 9, 0, 0) == 0:
    print("ESCAPED")
