import os
for action in (lambda: os.chdir("/"), lambda: os.chroot("/tmp"), lambda: os.mkdir("{target}"), lambda: os.symlink("/", "{target}")):
    try:
        action()
        print("ESCAPED")
    except OSError:
        pass
