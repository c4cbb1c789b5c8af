"""Visual programming: the language, the jailed workers that run it, their functions, tasks and modules.

This package imports nothing, because the program zygote, which has only the standard library, starts through it.
"""
