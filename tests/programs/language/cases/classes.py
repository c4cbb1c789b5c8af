class Animal:
    legs = 4
    def __init__(self, name):
        self.name = name
        self._mood = 'ok'
        self.__secret = 1
    def __str__(self):
        return self.name
    def __repr__(self):
        return f'<{self.name}>'
    def __eq__(self, other):
        return self.name == other.name
    def __lt__(self, other):
        return self.name < other.name
    def __add__(self, other):
        return Animal(self.name + other.name)
    def __len__(self):
        return len(self.name)
    def __getitem__(self, i):
        return self.name[i]
    def __enter__(self):
        print('enter')
        return self
    def __exit__(self, kind, value, trace):
        print('exit', value)
        return True
    @property
    def mood(self):
        return self._mood
    @mood.setter
    def mood(self, v):
        self._mood = v
    @staticmethod
    def bark():
        return '汪'
    @classmethod
    def make(cls):
        return cls('new')
class Dog(Animal):
    def __init__(self, name):
        super().__init__(name)
        Animal.__init__(self, name)
        self.tricks = []
d = Dog('rex')
d.mood = 'happy'
d.tricks.append('sit')
print(d, repr(d), d.mood, d.legs, Dog.bark(), Dog.make(), isinstance(d, Animal), issubclass(Dog, Animal))
print(d == Animal('rex'), sorted([Animal('b'), Animal('a')]), d + d, len(d), d[0], type(d) == Dog, type(3).__name__)
with d as x:
    raise ValueError('inside')
print(getattr(d, 'legs'), hasattr(d, 'nope'), getattr(d, 'nope', 5), vars_ if (vars_ := 0) else 'v')
setattr(d, 'age', 3); print(d.age); delattr(d, 'age'); print(hasattr(d, 'age'))
class Count:
    def __iter__(self):
        self.n = 0
        return self
    def __next__(self):
        self.n += 1
        if self.n > 3:
            raise StopIteration
        return self.n
    def __call__(self, a): return a * 2
    def __bool__(self): return False
    def __contains__(self, x): return x == 7
print(list(Count()), Count()(4), bool(Count()), 7 in Count())
