for _ in range(20000):
    print("", end="")
