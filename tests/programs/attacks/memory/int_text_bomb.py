x = 10 ** 4000
while True:
    x = x * x
    str(x % 10 ** 4000)
