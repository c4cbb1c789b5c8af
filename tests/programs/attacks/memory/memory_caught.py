keep = []
for _ in range(300):
    try:
        keep.append(bytearray(1 << 20))
    except BaseException:
        print("again", len(keep))
        keep.append(bytearray(1 << 10))
