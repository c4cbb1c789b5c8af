import ctypes
libc = ctypes.CDLL(None, use_errno=True)
params = ctypes.create_string_buffer(120)
for number in (425, 426, 427):
    if libc.syscall(ctypes.c_long(number), 8, params, 0, 0, 0, 0) >= 0:
        print("ESCAPED", number)
