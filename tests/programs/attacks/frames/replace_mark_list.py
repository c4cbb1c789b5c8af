import gc
for thing in gc.get_objects():
    if type(thing).__name__ == "PositionMemory":
        thing.cell.append(1)
        thing.cell.clear()
print("still here")
