def f():
    return 1
for constant in f.__code__.co_consts:
    print(type(constant))
    if isinstance(constant, list):
        constant[0] = "ESCAPED"
