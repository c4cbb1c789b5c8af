x = 7 ** 7 ** 99
print(x % 10)
