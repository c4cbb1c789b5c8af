@(lambda f: f.__globals__["__builtins__"])
def f():
    pass
print(f)
