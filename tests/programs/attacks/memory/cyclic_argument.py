x = []
x.append(x)
cyberdog.echo(x)
