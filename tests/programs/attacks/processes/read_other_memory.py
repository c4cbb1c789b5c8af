import ctypes
libc = ctypes.CDLL(None)
class V(ctypes.Structure):
    _fields_ = [("base", ctypes.c_void_p), ("len", ctypes.c_size_t)]
b = ctypes.create_string_buffer(64)
local, remote = V(ctypes.addressof(b), 64), V(0x400000, 64)
if libc.process_vm_readv({host}, ctypes.byref(local), 1, ctypes.byref(remote), 1, 0) >= 0:
    print("ESCAPED")
