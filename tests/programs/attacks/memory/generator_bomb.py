def forever():
    while True:
        yield from forever()
list(forever())
