import time as t
from time import sleep, strftime
print(t.strftime('%Y-%m-%d %H:%M:%S', t.gmtime(86400)), t.gmtime(0).tm_year, t.localtime(0).tm_hour)
print(t.strptime('2024-02-29 08:30', '%Y-%m-%d %H:%M').tm_yday, t.asctime(t.gmtime(0)), strftime('%H', t.gmtime(3600)))
print(int(t.mktime(t.gmtime(7200))), t.struct_time, isinstance(t.gmtime(1), t.struct_time))
try:
    sleep(-1)
except ValueError as e:
    print(e)
