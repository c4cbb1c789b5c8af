s = 'Hello, ' "机器狗"
print(s, len(s), s[0], s[-1], s[::-1], s[7:], s * 2)
print(s.upper(), s.find("机"), s.replace("Hello", "你好"), "a,b,c".split(","), "-".join(["x", "y"]))
print("%s 有 %d 条腿，%.2f 米，%05d %x %%" % ("狗", 4, 1.234, 42, 255))
print("{} {1}".format if False else "{0} {1:>5} {name!r} {0:.3}".format("abcdef", 7, name="狗"))
print(f"{s!r:>20} {3.14159:.2f} {len(s)=} {'x':*^7} {1000000:,}")
print("\u72d7 \x41 \t| \\n", r"\d+", """two
lines""")
print("ab" < "b", "a" in "cat", "狗".encode("utf-8"), b"\xe7\x8b\x97".decode(), "狗".encode("gbk"))
print("  x ".strip() + "|", "x".center(5, "."), "7".zfill(3), "abc".isalpha(), ord("a"), chr(29399), "Ab".swapcase())
print("{:>{}}".format("r", 4), "{a[0]} {a[1]}".format(a=[1, 2]), str.format("{}-{}", 1, 2), "{{}}".format())
print(list(map("<{}>".format, [1, 2])), "\N{BULLET}")
