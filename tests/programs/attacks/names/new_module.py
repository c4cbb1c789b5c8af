import sqlite3
print("ESCAPED: a module was read from the disk")
