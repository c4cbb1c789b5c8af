n = 0
while true:
    n += 1
    if n == 3:
        continue
    elif n > 5:
        break
    else:
        print('当前数字：', n)
print('最终数字：', n);
while n > 4:
    n -= 1
else:
    print('else', n)
for i in range(10, 0, -3):
    print(i, end=' ')
else:
    print('for else')
for x in 'ab':
    for y in (1, 2):
        if y == 2: break
        print(x, y)
if not false: print('yes')
pass
x = 5 if n else 6
print(x, (y := 3) + y)
match [1, 2, 3]:
    case [1, *rest]:
        print('rest', rest)
match {'k': 5}:
    case {'k': int(v)} if v > 4:
        print('k', v)
match 3:
    case 1 | 2:
        print('no')
    case _:
        print('default')
assert true, 'never'
