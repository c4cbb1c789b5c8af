class A:
    def __str__(self):
        return open("{secret}").read()
print("%s" % A(), "{0}".format(A()), f"{A()}")
