a = 10
b = 20
print(a + b, a - b, a * b, b / a, b % a, a ** b, 9 // 2, -9 // 2)
print(a == b, a != b, a > b, a < b, a >= b, a <= b)
a, b = 60, 13
print(a & b, a | b, a ^ b, ~a, a << 2, a >> 2)
c = 21
c += 2; c *= 3; c -= 1; c /= 4; c %= 9; c **= 2; c //= 3
print(c)
print(a and b, a or b, not (a and b), 0 and 1, [] or "empty")
print(2 in [1, 2], 5 not in (1, 2), "k" in {"k": 1}, a is a, a is not b)
print(1 < 2 < 3, 1 | 6 ^ 3 & 2, not 1 == 2, -2 ** 2, 2 ** 3 ** 2)
