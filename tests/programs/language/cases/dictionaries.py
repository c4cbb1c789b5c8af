d = {'name': '狗', 2: [1], (1, 2): None}
d['age'] = 3
d.update(legs=4)
print(d, len(d), d['name'], d.get('x'), d.get('x', 0), 'age' in d)
print(d.has_key('name'), d.has_key('x'))
del d[2]
print(d.pop('age'), list(d.keys()), list(d.values()), list(d.items())[0])
for k in d:
    print(k, end=' ')
print()
print({**d, 'x': 1}, {k: v for k, v in zip('ab', (1, 2))}, dict(a=1), dict([(1, 2)]), dict.fromkeys('ab', 0))
d.setdefault('n', []).append(1)
try:
    d['missing']
except KeyError as e:
    print('KeyError', e)
d.clear()
print(d, not d)
class Box:
    def has_key(self, k):
        return 'own ' + k
    def format(self):
        return 'own format'
print(Box().has_key('z'), Box().format())
