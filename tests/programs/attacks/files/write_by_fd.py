import os
fd = os.open("{target}", os.O_CREAT | os.O_WRONLY)
print("ESCAPED", os.write(fd, b"x"))
