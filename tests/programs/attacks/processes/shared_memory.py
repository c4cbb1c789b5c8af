import ctypes
libc = ctypes.CDLL(None)
if libc.memfd_create(b"x", 0) >= 0 or libc.shmget(1, 4096, 0o1666) >= 0:
    print("ESCAPED")
