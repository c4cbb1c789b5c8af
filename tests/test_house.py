"""The limits of CONTRIBUTING: short files and functions, folders that one can survey, plain words."""

import ast
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parent.parent
FILES_MAX = 25  # modules in a folder of src
CROWDED = {
    "src/roboglot/cli": 27,
    "src/roboglot/autonomy/navigation": 27,
    "src/roboglot/console": 30,
}  # may only shrink
LINES_MAX = 400  # of a module
HOPS_MAX = 8  # files that a request enters
FUNCTION_MAX = 50  # lines, without the docstring
GENERATED = ("_pb2.py", "_pb2_grpc.py")
WORDS_MAX = 5.5  # in 10,000 lines of src; the goal is 5
SOURCES = sorted(p for p in (ROOT / "src").rglob("*.py") if not p.name.endswith(GENERATED))


def functions(path: Path) -> Iterator[tuple[str, int]]:
    """Name and number of lines of each function, without decorators and docstring."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            begin = node.body[1].lineno if ast.get_docstring(node) and len(node.body) > 1 else node.lineno
            yield node.name, (node.end_lineno or begin) - begin + 1


def test_no_folder_is_crowded() -> None:
    """A folder that grows beyond this becomes two, each with a purpose."""
    crowds = Counter(path.parent.relative_to(ROOT) for path in SOURCES)
    assert {str(folder): n for folder, n in crowds.items() if n > CROWDED.get(str(folder), FILES_MAX)} == {}


def test_no_file_is_long() -> None:
    """A file does one thing."""
    files = [*SOURCES, *(ROOT / "tests").rglob("*.py"), *(ROOT / "benchmarks").glob("*.py")]
    counted = {str(path.relative_to(ROOT)): len(path.read_text().splitlines()) for path in files}
    assert {name: lines for name, lines in counted.items() if lines > LINES_MAX} == {}


def test_no_function_is_long() -> None:
    """Kernels are exempt: one loop over plain arrays, in which a call costs."""
    sources = [path for path in SOURCES if "kernels" not in path.parts]
    long = {
        f"{path.relative_to(ROOT)}:{name}": n for path in sources for name, n in functions(path) if n > FUNCTION_MAX
    }
    assert long == {}


def test_plain_words() -> None:
    """The words of scripts/words.txt make a sentence be read twice; a few are data or another's own words."""
    words = [line.partition("->")[0] for line in (ROOT / "scripts" / "words.txt").read_text().splitlines()]
    pattern = re.compile(rf"\b(?:{'|'.join(words)})\b", re.IGNORECASE)
    texts = [path.read_text() for path in SOURCES]
    found = sum(len(pattern.findall(text)) for text in texts)
    assert found / sum(text.count("\n") for text in texts) * 10_000 < WORDS_MAX


def test_the_walk_in_the_docs_is_the_way_through_the_code() -> None:
    """Each step of the walk is registered in a table or called by a step before it, in eight files at most."""
    page = (ROOT / "docs" / "architecture.md").read_text()
    walk = page[page.index("## One request") : page.index("## Truthfulness")]
    steps = re.findall(r"`([\w/]+\.py): (\w+)`", walk)
    called: set[str] = {steps[0][1]}
    for file, name in steps:
        tree = ast.parse((ROOT / "src" / "roboglot" / file).read_text())
        (found,) = [
            node
            for node in ast.walk(tree)
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node.name == name
        ]
        registered = any(isinstance(mark, ast.Call) for mark in found.decorator_list)
        assert name in called or registered, f"{file}: {name}"
        calls = [node.func for node in ast.walk(found) if isinstance(node, ast.Call)]
        called |= {func.attr if isinstance(func, ast.Attribute) else getattr(func, "id", "") for func in calls}
    assert len({file for file, _ in steps}) <= HOPS_MAX
