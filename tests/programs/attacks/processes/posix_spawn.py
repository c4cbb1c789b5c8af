import os
pid = os.posix_spawn("/bin/sh", ["sh", "-c", "echo x > {target}"], {})
print("ESCAPED", pid)
