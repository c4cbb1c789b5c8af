"""The pupils' language: Python 3 with short lists of allowed imports, names and attributes, checked before it runs.

Knows no robot, no process and no file: text in, problems or code out. The check gives good messages and a second
layer of defence; the boundary that confines a hostile program is the worker's jail, never this package.
"""

from roboglot.programs.language.check import check, compile_unit, uses
from roboglot.programs.language.names import BUILTINS, MODULES, Namespace
from roboglot.programs.language.problems import Problem, ProblemKind

__all__ = ["BUILTINS", "MODULES", "Namespace", "Problem", "ProblemKind", "check", "compile_unit", "uses"]
