def f(n):
    return [n] * 1000, f(n + 1)
f(0)
