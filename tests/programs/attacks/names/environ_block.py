import ctypes
libc = ctypes.CDLL(None)
environ = ctypes.POINTER(ctypes.c_char_p).in_dll(libc, "environ")
i = 0
while environ and environ[i]:
    print(environ[i])
    i += 1
start = ctypes.addressof(environ[0].contents) if False else 0
