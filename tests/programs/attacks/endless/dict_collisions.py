d = {}
m = (1 << 61) - 1
for i in range(10 ** 7):
    d[i * m] = i
