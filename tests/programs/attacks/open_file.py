print(open("{secret}").read())
