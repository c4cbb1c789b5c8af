import ctypes
import gc
cyberdog.echo(1)
for thing in gc.get_objects():
    if type(thing).__name__ == "PositionMemory":
        ctypes.memset(ctypes.addressof(thing._table), 0xFF, ctypes.sizeof(thing._table))
cyberdog.echo(2)
raise ValueError("from nowhere")
