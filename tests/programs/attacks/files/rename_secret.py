import os
os.rename("{secret}", "{target}")
