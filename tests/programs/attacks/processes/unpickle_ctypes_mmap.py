import mmap
with open("/dev/zero", "r+b") as file:
    print("ESCAPED", mmap.mmap(file.fileno(), 4096))
