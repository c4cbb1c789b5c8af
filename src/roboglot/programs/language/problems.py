"""Problems of a program in words that a pupil understands, in English and in Chinese.

Knows CPython's syntax messages (a table turns them into sentences) and nothing about running programs.
"""

from __future__ import annotations

import re
from enum import StrEnum

from roboglot.values import dataclass


class ProblemKind(StrEnum):
    """Kind of a problem: the rule that a program broke."""

    SYNTAX = "syntax"
    """Not Python."""
    POLICY = "policy"
    """Python, but not part of the robot language."""
    NAME = "name"
    """An undefined name."""
    SIZE = "size"
    """Too long or too deep."""


@dataclass(frozen=True, slots=True)
class Problem:
    """One problem. ``line`` and ``column`` (in characters) count from 1; the sentences need no other context."""

    line: int
    column: int
    kind: ProblemKind
    english: str
    chinese: str


# The parser's message (a regular expression), then the pupil's sentences; {0} is the first group. First match wins.
_SENTENCES = r"""'(.)' was never closed
This '{0}' is never closed.
这个 '{0}' 没有配对的右括号。

unmatched '(.)'
This '{0}' closes nothing: its partner is missing.
这个 '{0}' 多余，前面没有配对的左括号。

closing parenthesis '(.)' does not match opening parenthesis '(.)'
'{0}' cannot close '{1}': the brackets don't match.
'{0}' 与前面的 '{1}' 不配对。

unterminated (?:triple-quoted )?(?:[ft]-)?string
The text in quotes does not end: a quote is missing.
字符串缺少结束引号。

invalid (?:character '(.)'|non-printable character (\S+))
The character '{0}' is not part of the language; is it a full-width sign? Use the plain one.
字符 '{0}' 不能用在程序里；请改用英文半角符号。

expected ':'
A ':' is missing at the end of this line.
这一行末尾缺少冒号 ':'。

expected an indented block
The lines that belong to this block must be indented.
属于这个语句的代码需要缩进。

unexpected indent
This line is indented more than the one before.
这一行的缩进太多了。

unindent does not match
This line's indentation fits no block above.
这一行的缩进与上面任何一层都对不上。

inconsistent use of tabs
Tabs and blanks are mixed in the indentation.
缩进混用了制表符和空格。

Missing parentheses in call to '(print|exec)'
'{0}' needs parentheses, as in {0}(...).
'{0}' 需要括号，例如 {0}(...)。

Maybe you meant '=='
'=' stores a value; to compare two values write '=='.
'=' 是赋值；比较两个值请用 '=='。

cannot assign to (.+?)(?: here.*)?$
Nothing can be stored in {0}.
不能给 {0} 赋值。

cannot delete (.+)
{0} cannot be deleted.
不能删除 {0}。

'(return|yield)' outside function
'{0}' belongs inside a function.
'{0}' 只能写在函数里面。

'break' outside loop
'break' belongs inside a loop.
'break' 只能写在循环里面。

'continue' not properly in loop
'continue' belongs inside a loop.
'continue' 只能写在循环里面。

leading zeros in decimal
A number cannot begin with 0.
整数不能以 0 开头。

invalid decimal literal
A number is followed by a letter: a name cannot begin with a digit.
数字后面紧跟字母：名字不能以数字开头。

expected 'except' or 'finally'
'try' needs an 'except' or a 'finally'.
'try' 后面缺少 'except' 或 'finally'。

duplicate argument '(\w+)'
The parameter '{0}' appears twice.
参数 '{0}' 重复了。

keyword argument repeated: (\w+)
The argument '{0}' is given twice.
参数 '{0}' 重复了。

positional argument follows keyword
Arguments with a name come after those without.
带名字的参数要写在不带名字的后面。

name '(\w+)' is (?:used prior to|assigned to before) global
'global' must come before '{0}' is used.
'global' 要写在使用 '{0}' 之前。

no binding for nonlocal '(\w+)'
No surrounding function has a '{0}'.
外层函数里没有 '{0}'。

forgot a comma
A comma seems to be missing here.
这里好像少了一个逗号。

unexpected EOF|EOF in multi-line
The program ends in the middle of a statement.
程序在语句中间就结束了。

unexpected character after line continuation
Nothing may follow the '\' at the end of a line.
行末的 '\' 后面不能再有内容。

f-string: single '(.)' is not allowed
In an f-string, a '{0}' of the text is written twice.
f 字符串里，文字中的 '{0}' 要写两遍。

^[ft]-string
What is in the braces of this f-string is not valid.
f 字符串的花括号里写得不对。

expected 'else' after 'if'
An 'if' inside an expression needs an 'else'.
表达式里的 'if' 后面缺少 'else'。

dictionary key
An entry of a dictionary is a key, a ':' and a value.
字典的每一项由键、':' 和值组成。

^'in' expected
'for' needs an 'in' after its variables.
'for' 的变量后面缺少 'in'。

expected (?:default|argument) value
A value is missing after '='.
'=' 后面缺少值。

(?:without a|non-)\s?default (?:argument )?follows
Parameters with a default come after those without.
带默认值的参数要写在不带默认值的后面。

expression cannot contain assignment
The name of an argument cannot be an expression; to compare two values write '=='.
参数名不能是表达式；比较两个值请用 '=='。

xpected one or more names after '(\w+)'
A name is missing after '{0}'.
'{0}' 后面缺少名字。

^expected (?:one of )?'([^']+)'
A '{0}' is missing here.
这里缺少 '{0}'。

null byte
The program contains an invisible character that does not belong there.
程序里有不可见的非法字符。

^invalid syntax\.\s+(?:Did you mean|Maybe you meant) '([^']+)'
This is not a valid statement; perhaps '{0}' is meant.
这里的写法不对，也许应该写成 '{0}'。

^write '(.+)' for '(.+)'$
Python writes '{0}' for '{1}'.
Python 里 '{1}' 写成 '{0}'。

^invalid syntax$
This is not a valid statement.
这里的写法不对。
"""

_HABITS = {"else if": "elif", "&&": "and", "||": "or", "++": "+= 1", "--": "-= 1"}  # of other languages
_HABIT = re.compile(r"(?:(else) +i|(&&|\|\||\+\+|--)\W*)$")  # as far as the place of the error
_VAGUE = ("invalid syntax", "expected ':'")
_SYNTAX = [tuple(entry.split("\n")) for entry in _SENTENCES.strip().split("\n\n")]


def from_syntax_error(message: str, line: int, column: int, text: str = "") -> Problem:
    """Return the problem for one of CPython's syntax messages about a line's text; an unknown message is quoted."""
    if message in _VAGUE and (found := _HABIT.search(text[:column])):
        habit = found[2] or "else if"
        message = f"write '{_HABITS[habit]}' for '{habit}'"
    for pattern, english, chinese in _SYNTAX:
        found = re.search(pattern, message)
        if found:
            groups = [group for group in found.groups() if group] + [""] * 2
            return Problem(line, column, ProblemKind.SYNTAX, english.format(*groups), chinese.format(*groups))
    return Problem(line, column, ProblemKind.SYNTAX, f"This is not valid: {message}.", f"语法错误：{message}。")
