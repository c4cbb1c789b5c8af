"""The limits of CONTRIBUTING: short files and functions, folders that one can survey, plain words."""

import ast
import re
import shutil
import subprocess
import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path

import pytest

from tests.statements import parsed, statements

ROOT = Path(__file__).parent.parent
FILES_MAX = 25  # modules in a folder of src, pages, benchmarks
LINES_MAX = 400  # of a module
ANY_MAX = 221  # lines; may only shrink
NAME_MAX = 8  # words of a test's name after "test"
HOPS_MAX = 8  # files that a request enters
FUNCTION_MAX = 50  # lines, without the docstring
METHODS_MAX = 24  # of a class, properties too
WIDE = {  # classes with more, and why
    "PipeEnd": "an asyncio.Transport, whose methods are half of it",
    "WorldStage": "a Stage",
    "Stage": "one verb for each change of a world: consoles, agents and scenarios call them by name",
}
GENERATED = ("_pb2.py", "_pb2_grpc.py")
WORDS_MAX = 5  # in 10,000 lines
RIDDLES = set(re.findall(r"\w+", "how if nobody now what whatever when where whether which who whoever whom whose why"))
SUBJECT = re.compile(r"(?=.{1,60}$)[a-z][\w ,./-]*: [a-z].*[^.]")  # of a commit
HEADING = re.compile("#+ [^`]*$")
HEADING_MAX = 80  # a longer one has swallowed its paragraph
COLUMNS_MAX = 120  # of a line of docs; table rows, code and what is generated may be longer
CHAPTERLESS = {  # modules of a vendor's package that belong to no chapter of its manual
    "wire": "annexb channel cloud codes commands geometry lines messages orders proto relay replies requests telemetry "
    "text versions zenoh",
    "clients": "calls client cloud control datagrams errors events http link listeners media noting pairing running "
    "search texts values",
    "drivers": "capabilities components driver media_feed motion state telemetry vocabulary watchdog watchdog_process",
}
SOURCES = sorted(p for p in (ROOT / "src").rglob("*.py") if not p.name.endswith(GENERATED))

TESTS = sorted((ROOT / "tests").rglob("*.py"))

TOOLS = sorted(path for folder in ("benchmarks", "scripts", "examples") for path in (ROOT / folder).rglob("*.py"))

BY_PROGRAM = [ROOT / "docs" / name for name in ("capabilities.md", "coverage.md", "reference/programs.md")]
PAGES = sorted(p for p in [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")] if p not in BY_PROGRAM)


@cache
def statements_of(path: Path) -> list[ast.AST]:
    """Return a file's statements, found once for all tests."""
    return statements(parsed(path))


def functions(path: Path) -> Iterator[tuple[str, int]]:
    """Name and number of lines of each function, without decorators and docstring."""
    for node in statements_of(path):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            begin = node.body[1].lineno if ast.get_docstring(node) and len(node.body) > 1 else node.lineno
            yield node.name, (node.end_lineno or begin) - begin + 1


def test_no_folder_is_crowded() -> None:
    """A folder that grows beyond this becomes two, each with a purpose."""
    others = [*TESTS, *(ROOT / "docs").rglob("*.md"), *(ROOT / "benchmarks").rglob("*.py")]
    crowds = Counter(path.parent.relative_to(ROOT) for path in [*SOURCES, *others])
    assert {str(folder): n for folder, n in crowds.items() if n > FILES_MAX} == {}


def modules_in(folder: Path) -> set[str]:
    """Names of modules and packages there."""
    return {path.stem for path in folder.glob("[!_]*") if path.suffix == ".py" or path.is_dir()}


@pytest.mark.parametrize("package", CHAPTERLESS)
def test_chapters_have_the_names_of_the_door(package: str) -> None:
    """A chapter of a vendor's manual has the same name in every package of the vendor."""
    sources = ROOT / "src" / "roboglot"
    doors = {door.name: modules_in(door / "chapters") for door in (sources / "protocols").iterdir() if door.is_dir()}
    vendors = [folder for folder in (sources / package).iterdir() if folder.name in doors.keys() - {"__pycache__"}]
    strange = {folder.name: modules_in(folder / "chapters") - doors[folder.name] for folder in vendors}
    assert {vendor: names for vendor, names in strange.items() if names} == {}
    beside = set().union(*(modules_in(folder) for folder in vendors)) - {"chapters"}
    assert sorted(beside) == CHAPTERLESS[package].split()


def test_no_file_is_long() -> None:
    """A file does one thing."""
    files = [*SOURCES, *TESTS, *(ROOT / "benchmarks").rglob("*.py")]
    counted = {str(path.relative_to(ROOT)): len(path.read_text().splitlines()) for path in files}
    assert {name: lines for name, lines in counted.items() if lines > LINES_MAX} == {}


def test_no_function_is_long() -> None:
    """Kernels are exempt: one loop over plain arrays, in which a call costs."""
    sources = [path for path in SOURCES if "kernels" not in path.parts]
    long = {
        f"{path.relative_to(ROOT)}:{name}": n for path in sources for name, n in functions(path) if n > FUNCTION_MAX
    }
    assert long == {}


def methods(path: Path) -> Iterator[tuple[str, int]]:
    """Name of each class and how many methods it has itself; a property with its setter is one."""
    for node in statements_of(path):
        if isinstance(node, ast.ClassDef):
            yield node.name, len({m.name for m in node.body if isinstance(m, ast.FunctionDef | ast.AsyncFunctionDef)})


def test_no_class_is_wide() -> None:
    """A class with more methods does several things: each can have a name and state of its own."""
    wide = {name for path in SOURCES for name, n in methods(path) if n > METHODS_MAX}
    assert wide == WIDE.keys()


def names_of_tests() -> set[str]:
    """Names of all tests."""
    return {name for path in TESTS for name, _ in functions(path) if name.startswith("test_")}


def test_names_of_tests_are_short() -> None:
    """A name says the behaviour, not its whole story: that stands in the docstring."""
    assert {name for name in names_of_tests() if len(name.split("_")) - 1 > NAME_MAX} == set()


def test_names_of_tests_begin_with_the_subject() -> None:
    """As docstrings do: "invalid goals are refused", not "what cannot be is refused"."""
    assert {name for name in names_of_tests() if name.split("_")[1] in RIDDLES} == set()


@pytest.mark.parametrize("texts", [SOURCES, PAGES, TESTS, TOOLS], ids=["src", "docs", "tests", "tools"])
def test_plain_words(texts: list[Path]) -> None:
    """The words of scripts/words.txt make a sentence be read twice; a few are data or another's own words."""
    words = [line.partition("->")[0] for line in (ROOT / "scripts" / "words.txt").read_text().splitlines()]
    pattern = re.compile(rf"\b(?:{'|'.join(words)})\b", re.IGNORECASE)
    read = [path.read_text() for path in texts]
    found = sum(len(pattern.findall(text)) for text in read)
    assert found / sum(text.count("\n") for text in read) * 10_000 < WORDS_MAX


def docstrings(path: Path) -> Iterator[tuple[int, str]]:
    """Line and text of each docstring of a file."""
    for node in statements_of(path):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            text = ast.get_docstring(node)
            yield from [(node.body[0].lineno, text)] if text else []


@pytest.mark.parametrize("files", [SOURCES, TESTS, TOOLS], ids=["src", "tests", "tools"])
def test_docstrings_begin_with_verb_or_noun(files: list[Path]) -> None:
    """They name a thing or say what is done; a question or a subordinate clause has to be read twice."""
    found = [
        f"{path.relative_to(ROOT)}:{line}"
        for path in files
        for line, text in docstrings(path)
        if re.split(r"\W+", text.lstrip("`"), maxsplit=1)[0].lower() in RIDDLES
    ]
    assert found == []


def test_functions_say_what_they_do() -> None:
    """A function's docstring begins with a verb ("Return the map"), a property's with a noun."""
    found = []
    for path in SOURCES:
        for node in statements_of(path):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and (text := ast.get_docstring(node)):
                made = " ".join(map(ast.unparse, node.decorator_list))
                noun = node.name == "__init__" or any(word in made for word in ("property", "fixture"))
                if not noun and text.split()[0] in {"A", "All", "An", "It", "The", "They"}:
                    found.append(f"{path.relative_to(ROOT)}:{node.lineno}")
    assert found == []


@pytest.mark.parametrize("files", [SOURCES, TESTS, TOOLS], ids=["src", "tests", "tools"])
def test_docstrings_say_nothing_twice(files: list[Path]) -> None:
    """Sentences were doubled where docstrings had been wrapped by a tool."""
    found = []
    for path in files:
        for line, text in docstrings(path):
            sentences = [" ".join(part.split()) for part in re.split(r"(?<=[.!?)])\s+", text)]
            if any(sentences.count(each) > 1 for each in sentences if len(each) > 12):
                found.append(f"{path.relative_to(ROOT)}:{line}")
    assert found == []


def test_commit_subjects_have_an_area_and_fit() -> None:
    """`area: imperative`, 60 characters at most; asked of the commits that are not pushed yet and can be mended."""
    git = shutil.which("git")
    if git is None or not (ROOT / ".git").exists():
        pytest.skip("there is no history here")
    log = subprocess.run(
        [git, "log", "-20", "--no-merges", "--format=%s", "HEAD", "--not", "--remotes"],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    if log.returncode:
        pytest.skip("git does not read this checkout")
    assert [line for line in log.stdout.splitlines() if not SUBJECT.fullmatch(line)] == []


def test_no_ignored_file_is_tracked() -> None:
    """Caches of tools get in by force only."""
    listed = subprocess.run(["git", "ls-files", "-ci", "--exclude-standard"], cwd=ROOT, capture_output=True, text=True)
    if listed.returncode:
        pytest.skip("git does not read this checkout")
    assert listed.stdout.split() == []


def test_docs_are_not_wide() -> None:
    """A line that does not fit into an editor is hard to read in a change, too."""
    wide = {}
    for page in PAGES:
        code = False
        for number, line in enumerate(page.read_text().splitlines(), start=1):
            code ^= line.lstrip().startswith("```")
            if HEADING.match(line) and len(line) > HEADING_MAX and not code:
                wide[f"{page.name}:{number}"] = len(line)
            if len(line) > COLUMNS_MAX and not code and not line.startswith("|") and " " in line[:COLUMNS_MAX].strip():
                wide[f"{page.name}:{number}"] = len(line)
    assert wide == {}


def walks() -> dict[str, list[tuple[str, str]]]:
    """Return the walks of the docs by their titles: files and functions in order."""
    page = (ROOT / "docs" / "architecture.md").read_text()
    part = page[page.index("## Seven requests") : page.index("## Truthfulness")]
    titles = {text.partition("\n")[0]: text for text in part.split("\n### ")[1:]}
    return {title: re.findall(r"`([\w/]+\.py): (\w+)`", text) for title, text in titles.items()}


def names_in(node: ast.AST) -> set[str]:
    """Return the names called or mentioned there."""
    return {found.attr if isinstance(found, ast.Attribute) else getattr(found, "id", "") for found in ast.walk(node)}


def defined(tree: ast.Module, name: str) -> list[ast.AST]:
    """Functions of this name, or the table of a module."""
    return [
        node
        for node in ast.walk(tree)
        if (isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node.name == name)
        or (isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name) and node.target.id == name)
    ]


@pytest.mark.parametrize("walk", walks().values(), ids=list(walks()))
def test_walk_in_docs_is_way_through_the_code(walk: list[tuple[str, str]]) -> None:
    """Each step is registered in a table or mentioned by a step before it or its own file, in eight files at most."""
    assert len(walk) > 5
    mentioned: set[str] = {walk[0][1]}
    for file, name in walk:
        tree = parsed(ROOT / "src" / "roboglot" / file)
        steps = defined(tree, name)
        assert steps, f"{file} has no {name}"
        registered = any(isinstance(mark, ast.Call) for step in steps for mark in getattr(step, "decorator_list", ()))
        callback = name.startswith("_") and name in names_in(tree)
        assert name in mentioned or registered or callback, f"{file}: {name}"
        aliases = [alias for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) for alias in node.names]
        spelled = {alias.asname: alias.name for alias in aliases}
        mentioned |= {spelled.get(word) or word for step in steps for word in names_in(step)}
    assert len({file for file, _ in walk}) <= HOPS_MAX


def imports(path: Path, modules: Mapping[str, Path]) -> set[str]:
    """Return the modules of ours that a file imports, those for its types included."""
    found = set()
    for node in statements_of(path):
        if isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                module = f"{node.module}.{alias.name}"
                found.add(module if module in modules else node.module)
    return found & modules.keys()


def test_imports_go_round_in_no_circles() -> None:
    """Modules that import each other are one thing in many files; TYPE_CHECKING hides that from Python only."""
    named = {".".join(p.relative_to(ROOT / "src").with_suffix("").parts).removesuffix(".__init__"): p for p in SOURCES}
    graph = {module: imports(path, named) - {module} for module, path in named.items()}
    while leaves := [module for module, wanted in graph.items() if not wanted & graph.keys()]:
        for module in leaves:
            del graph[module]
    assert sorted(module for module in graph if module in _reach(graph, graph[module])) == []


def _reach(graph: Mapping[str, set[str]], begin: set[str]) -> set[str]:
    """Return every module that can be reached from ``begin``."""
    seen, todo = set[str](), [module for module in begin if module in graph]
    while todo:
        module = todo.pop()
        if module not in seen:
            seen.add(module)
            todo += [wanted for wanted in graph[module] if wanted in graph]
    return seen


def means_any(value: ast.expr | None, known: set[str]) -> bool:
    """Return whether an expression is ``Any``, another name of it, or a union with it."""
    match value:
        case ast.Name(id=name) | ast.Attribute(attr=name):
            return name == "Any" or name in known
        case ast.BinOp(left=left, right=right):
            return means_any(left, known) or means_any(right, known)
        case ast.Constant(value=str(text)) if text.isidentifier():
            return text == "Any" or text in known
    return False


def other_names_of_any(tree: ast.Module, known: Mapping[str, set[str]]) -> set[str]:
    """Names that a module gives to ``Any``, or has from modules that do: ``known``."""
    found: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            hidden = {"Any"} if node.module in ("typing", "typing_extensions") else known.get(node.module or "", set())
            found |= {alias.asname or alias.name for alias in node.names if alias.name in hidden} - {"Any"}
        elif isinstance(node, ast.Assign) and means_any(node.value, found):
            found |= {target.id for target in node.targets if isinstance(target, ast.Name)}
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name) and means_any(node.value, found):
            found.add(node.target.id)
    return found


def lines_with_any(texts: Mapping[str, str]) -> int:
    """Lines of modules, by name, that say ``Any`` or another name that one of them gives to it."""
    known, before = dict[str, set[str]](), {"": {"Any"}}
    while known != before:
        before, names = known, {"Any"}.union(*known.values())
        named = {module: text for module, text in texts.items() if any(name in text for name in names)}
        known = {module: other_names_of_any(ast.parse(text), before) for module, text in named.items()}
    words = {module: "|".join(sorted({"Any", *names})) for module, names in known.items()}
    return sum(len(re.findall(rf"^.*\b(?:{word})\b.*$", texts[name], re.MULTILINE)) for name, word in words.items())


def test_other_names_of_any_are_found() -> None:
    """They count like the name itself, wherever they are imported."""
    one = "from typing import Any, TypeAlias\nMessage: TypeAlias = Any\nNews = Message | None\n"
    two = "from one import News\nimport typing as t\nfrom typing import Any as Free\nX = t.Any\n"
    uses = "def f(a: News, b: Free) -> X: ...\ndef g(a: dict[str, X]) -> object: ...\ndef h(x: int) -> None: ...\n"
    assert lines_with_any({"one": one, "two": two + uses}) == 3 + 3 + 2


def test_untyped_places_become_fewer() -> None:
    """Lines of src with ``Any`` or another name of it; may only shrink."""
    stubs = [path for folder in ("src", "typings") for path in (ROOT / folder).rglob("*.pyi")]
    texts = {
        ".".join(path.relative_to(ROOT).with_suffix("").parts[1:]).removesuffix(".__init__"): path.read_text()
        for path in [*SOURCES, *stubs]
    }
    assert lines_with_any(texts) <= ANY_MAX


def test_layers_in_docs_are_those_that_are_enforced() -> None:
    """The page lists each package once, from top to bottom, as import-linter has them."""
    page = (ROOT / "docs" / "architecture.md").read_text().partition("## Layers")[2].partition("\n## ")[0]
    listed = [
        re.findall(r"`(\w+)`", line.partition("**: ")[0]) for line in page.splitlines() if line.startswith("- **")
    ]
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    layers = next(contract for contract in contracts if contract["id"] == "layers")["layers"]
    rank = {package: number for number, layer in enumerate(layers) for package in layer.split(" | ")}
    packages = [package for line in listed for package in line]
    assert sorted(packages) == sorted(rank)
    assert [rank[package] for package in packages] == sorted(rank.values())
