try:
    print.nothing
except AttributeError as e:
    print(e.obj.__globals__["os"].open("{secret}", 0))
