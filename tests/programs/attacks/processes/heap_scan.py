import gc
for thing in gc.get_objects():
    print(repr(thing)[:300])
