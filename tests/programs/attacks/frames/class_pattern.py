class X:
    __match_args__ = ("__globals__",)
match print:
    case object(__globals__=g):
        print(g.keys(), g["os"].listdir("/"))
