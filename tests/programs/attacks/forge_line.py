line = globals()["$line"]
for i in range(len(line)):
    line[i] = 0xFFFFFFFF
cyberdog.echo(1)
raise ValueError("from nowhere")
