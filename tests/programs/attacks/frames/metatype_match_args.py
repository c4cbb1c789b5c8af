T = type(type(1))
M = T("M", (T,), {"__instancecheck__": lambda c, o: True})
X = M("X", (), {"__match_args__": ("__globals__",)})
match print:
    case X(g):
        print(g["os"].open("{secret}", 0))
