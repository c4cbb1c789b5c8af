line = globals()["$line"]
line.value = 0xFFFFFFFF
import ctypes
ctypes.memset(ctypes.addressof(line), 0xFF, 4096)
cyberdog.echo(1)
raise ValueError("from nowhere")
