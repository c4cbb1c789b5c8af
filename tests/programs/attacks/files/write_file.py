open("{target}", "w").write("x")
