cyberdog.echo("x" * 3000000)
