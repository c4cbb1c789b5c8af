def area(w, h=2, *args, unit='m', **kw):
    "docs"
    return w * h, args, unit, kw
print(area(3), area(1, 2, 3, unit='cm', z=1), area(h=5, w=1))
def fib(n):
    return n if n < 2 else fib(n - 1) + fib(n - 2)
print(fib(15))
total = 0
def add(n):
    global total
    total += n
add(4); add(5)
print(total)
def counter():
    c = 0
    def inc():
        nonlocal c
        c += 1
        return c
    return inc
i = counter(); i()
print(i(), (lambda a, b=1: a + b)(2), list(map(lambda x: x * 2, [1, 2])))
def gen(n):
    for k in range(n):
        got = yield k
        if got: print('got', got)
g = gen(3)
print(next(g), g.send('hi'), list(g), sum(x for x in range(4)))
def both():
    yield from gen(2)
    return 7
print(list(both()), area.__name__)
def deco(f):
    def inner(*a):
        return 'deco ' + f(*a)
    return inner
@deco
def hello(name: str) -> str:
    return 'hello ' + name
print(hello('dog'))
def deep(n):
    return 0 if n == 0 else 1 + deep(n - 1)
print(deep(500))
try:
    deep(100000)
except RecursionError:
    print('too deep')
print(sorted([3, 1, 2], key=lambda v: -v), callable(deep), hello.__name__)
