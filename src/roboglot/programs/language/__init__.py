"""The pupils' language: Python 3 with a short list of what may be imported, named and reached, checked before it runs.

It knows no robot, no process and no file: text in, problems or code out. It is for good messages and for depth; the
boundary that keeps a hostile program in is the worker's jail, never this package.
"""

from roboglot.programs.language.check import check, compile_unit, uses
from roboglot.programs.language.names import BUILTINS, MODULES, Names
from roboglot.programs.language.problems import Problem, ProblemKind

__all__ = ["BUILTINS", "MODULES", "Names", "Problem", "ProblemKind", "check", "compile_unit", "uses"]
