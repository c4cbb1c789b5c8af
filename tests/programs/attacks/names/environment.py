import os
print(dict(os.environ), os.getenv("ROBOGLOT_TEST_SECRET"))
