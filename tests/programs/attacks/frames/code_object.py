def f():
    return 1
f.__code__ = f.__code__.replace(co_names=("open",))
code = compile("open('{secret}').read()", "x", "eval")
print(eval(code))
