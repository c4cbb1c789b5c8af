async def f():
    pass
c = f()
print(c.cr_frame.f_builtins["open"]("{secret}").read())
