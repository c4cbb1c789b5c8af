import os
for name in ("environ", "maps", "mem", "root", "fd"):
    try:
        fd = os.open("/proc/self/" + name, 0)
        print("ESCAPED", name)
    except OSError:
        pass
