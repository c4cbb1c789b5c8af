print("x" * 5000000)
