print([x for x in [1] if (__builtins__ := __builtins__)])
print(__builtins__["open"]("{secret}").read() if isinstance(__builtins__, dict) else __builtins__.open("{secret}").read())
