import sys
for name, module in list(sys.modules.items()):
    if hasattr(module, "open"):
        print(name)
        print(module.open("{secret}", 0))
