class S(str):
    def go(self, *args):
        return super().format(*args)
    def map(self, *args):
        return getattr(super(), "format")(*args)
class A:
    def __init__(self):
        self.x = 1
for text in ("{0.__init__.__globals__}", "{0.__class__.__mro__}"):
    try:
        print("LANGUAGE", S(text).go(A()))
    except AttributeError as e:
        print(e)
    try:
        print("LANGUAGE", S(text).map(A()))
    except AttributeError as e:
        print(e)
    print("LANGUAGE", str.format(text, A()))
