import _thread
def f():
    print("ESCAPED")
for _ in range(100):
    _thread.start_new_thread(f, ())
