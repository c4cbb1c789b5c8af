import ctypes
libc = ctypes.CDLL(None, use_errno=True)
for option, value in ((1, 0), (4, 1), (22, 0), (38, 0), (15, 0)):
    if libc.prctl(option, value, 0, 0, 0) == 0:
        print("ESCAPED", option)
