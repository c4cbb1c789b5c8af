class A:
    def __init__(self):
        self.x = 1
print("{0.__init__.__globals__}".format(A()))
print("{0.__class__.__mro__[1].__subclasses__}".format(A()))
__import__("os").system("cat {secret}")
