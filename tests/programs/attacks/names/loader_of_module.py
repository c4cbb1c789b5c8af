print(time.__loader__, time.__spec__)
import math
print(math.__loader__.load_module("posix").open("{secret}", 0))
