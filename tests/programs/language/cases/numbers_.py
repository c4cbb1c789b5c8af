import math
import numbers
from math import pi as π, sqrt
print(0x1F, -0x01, 0.1e+18, -.5, 3e2, 1_000)
print(3.14j, 3e+2J * 2, (1 + 2j).conjugate(), abs(3 + 4j), complex(1, 2).imag)
print(round(2.675, 2), round(0.5), round(1.5), int(-3.9), divmod(-7, 2), float("inf"))
print(2 ** 200)
print(len(str(3 ** 8000)), sum(range(101)), min(3, 1, 2), max([4, 9]), pow(2, 10, 1000))
print(math.floor(-1.5), math.ceil(1.2), round(π, 4), sqrt(16), math.hypot(3, 4), math.isclose(0.1 + 0.2, 0.3))
print(isinstance(3, numbers.Number), isinstance(3j, numbers.Real), bin(10), hex(255), oct(8), int("ff", 16))
print(0.1 + 0.2, 1e16, 1e-7, 100000000000000000000.0, float("nan") == float("nan"))
