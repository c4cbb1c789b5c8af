import ctypes, sys
libc = ctypes.CDLL(None, use_errno=True)
free = {0, 1, 9, 10, 11, 12, 15, 24, 25, 28, 60, 96, 202, 219, 228, 229, 231, 318}
free |= {335, 336}  # uretprobe and uprobe: the kernel lets them past every filter and kills who calls them
if "x86_64" not in sys.implementation._multiarch:  # the jail allows no uname
    free = {63, 64, 93, 94, 98, 113, 114, 124, 128, 139, 169, 214, 215, 216, 222, 226, 233, 278}
for number in list(range(480)) + [1 << 30, (1 << 30) + 59, (1 << 30) + 520]:
    if number in free:
        continue
    ctypes.set_errno(0)
    result = libc.syscall(ctypes.c_long(number), 0, 0, 0, 0, 0, 0)
    if result != -1 or ctypes.get_errno() != 1:
        print("ESCAPED", number, result, ctypes.get_errno())
