import ctypes, gc
for thing in gc.get_objects():
    if type(thing).__name__ == "PositionMemory":
        table = thing._table
        for i in range(len(table)):
            table[i] = table[0]
cyberdog.echo(1)
while True:
    pass
