class Low(Exception):
    pass
def risky(n):
    if n == 0: raise ValueError('zero')
    if n == 1: raise Low('low', 1)
    return 1 / (n - 2)
for n in range(4):
    try:
        print(risky(n))
    except ValueError as e:
        print('ValueError', e)
    except (Low, KeyError) as e:
        print(type(e).__name__, e.args)
    except Exception as e:
        print('other', e)
    else:
        print('fine')
    finally:
        print('finally', n)
try:
    try:
        {}['k']
    except KeyError as e:
        raise RuntimeError('outer') from e
except RuntimeError as e:
    print(e)
try:
    assert 1 == 2, 'not equal'
except AssertionError as e:
    print(e)
try:
    int('x')
except ValueError as e:
    print(e)
try:
    print(later)
except NameError as e:
    print(e)
later = 1
try:
    None.x
except AttributeError as e:
    print(e)
try:
    [][0]
except IndexError:
    print('index')
try:
    '1' + 1
except TypeError as e:
    print(e)
