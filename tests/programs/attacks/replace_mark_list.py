import gc
for thing in gc.get_objects():
    if type(thing).__name__ == "Whereabouts":
        thing.tell.append(1)
        thing.tell.clear()
print("still here")
