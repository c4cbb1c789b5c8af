def f(x: __import__("os").system("touch {target}")):
    return x
print(f.__annotations__)
