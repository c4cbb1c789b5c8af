class M(type):
    def __getattr__(cls, name):
        return open
class A(metaclass=M):
    pass
print(A.anything("{secret}").read())
