l = [3, 1, 2]
l.append(5); l.insert(0, 9); l.extend([7]); l += [8]
print(l, len(l), l[1:3], l[::2], l.index(2), l.count(9))
del l[0]
del l[1:3]
l.sort(reverse=True)
print(l, l.pop(), l.pop(0), l, sorted(l), list(reversed(l)))
l.remove(7); l.reverse()
print(l, [x * x for x in range(5) if x % 2], [[0] * 2 for _ in range(2)], sum(l), [1, 2] + [3], [0] * 3)
t = (1, 2, 3)
a, *b = t
print(t, t[1], a, b, (1,), t + (4,), len(t), max(t), t == (1, 2, 3))
try:
    t[0] = 1
except TypeError as e:
    print(e)
for i, x in enumerate("ab", 1):
    print(i, x, end=";")
print()
print(list(zip([1, 2], "ab")), any([0, 1]), all([]), list(filter(None, [0, 1, 2])), list(map(str, t)))
m = [1, 2, 3]
m[0], m[2] = m[2], m[0]
m[1:2] = [7, 8]
print(m, [1, 2] < [1, 3], {3, 1, 1} == {1, 3}, frozenset([1]) | {2}, {1, 2} & {2, 3})
