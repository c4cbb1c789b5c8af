"""The other end of a run: a clean zygote process, the jail it forks programs into, and what a program finds inside.

Standard library only, and Linux only. It knows no robot: what a program can call is a list of names that came over
its one socket.
"""
