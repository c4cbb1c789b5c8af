"""Visual programming: the language, the jailed workers that run it, and what is built on them.

Importing this package costs nothing and pulls nothing in: the program zygote starts through it, with the standard
library alone.
"""
