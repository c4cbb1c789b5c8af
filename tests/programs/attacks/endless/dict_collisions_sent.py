m = (1 << 61) - 1
for chosen in {i * m: 0 for i in range(1000)}, {(i * m,): 0 for i in range(1000)}:
    try:
        cyberdog.echo(chosen)
        print("ESCAPED: the server had to build it")
    except ValueError as error:
        print(error)
