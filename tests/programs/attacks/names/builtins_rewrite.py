__builtins__.print = None
import builtins
builtins.open("{secret}")
