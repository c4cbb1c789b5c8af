g = print.__globals__ if hasattr(print, "__globals__") else {}
print(g["builtins"].open("{secret}").read())
