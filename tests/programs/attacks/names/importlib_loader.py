import importlib
import importlib.util
print(importlib.util.spec_from_file_location("x", "{secret}").loader.get_data("{secret}"))
