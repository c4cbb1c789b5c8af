exec("import os\nos.system('cat {secret}')\nprint(open('{secret}').read())")
