try:
    raise Exception()
except Exception as error:
    frame = error.__traceback__.tb_frame
    while frame:
        print(frame.f_globals.get("os"))
        frame = frame.f_back
