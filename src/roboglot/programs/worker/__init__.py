"""The worker's end of a run: a clean zygote process, the jail of its forked programs, and their environment.

Standard library only, and Linux only. Knows no robot: the callable names are a list received over the one socket.
"""
