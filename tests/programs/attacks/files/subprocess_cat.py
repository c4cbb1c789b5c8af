import subprocess
print(subprocess.run(["cat", "{secret}"], capture_output=True).stdout)
