"""Rules of the house that no tool checks: who may import whom, and so on."""

import ast
from collections.abc import Iterator
import functools
import os
from pathlib import Path
import re
import shutil
import subprocess
import sys

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "drake_affetto"

# The way of the signal, then what is built on it. Nothing imports from a later
# place; what stands in one place may import each other.
ORDER = [
    {"", "common"},
    {"geometry"},
    {"scene"},
    {"perception"},
    {"calibration"},
    {"skill"},
    {"motion"},
    {"control"},
    {"pneumatics"},
    {"sensing"},
    {"sound"},
    {"faults"},
    {"teaching"},
    {"station", "scenario"},
    {"robot"},
    {"runner"},
    {"experiments"},
    {"envs"},
    {"tuning"},
    {"identification"},
    {"report"},
    {"cli"},
]
RANK = {name: rank for rank, names in enumerate(ORDER) for name in names}
STAGES = [name for names in ORDER[1:13] for name in names]

# The mathematics, which must also serve who has no Drake. The test adds to
# them every module of a stage that does not import Drake in its own text.
DRAKE_FREE = {
    "drake_affetto",
    "drake_affetto.cli.main",
    "drake_affetto.control.pidf",
    "drake_affetto.common.errors",
    "drake_affetto.motion.dmp",
    "drake_affetto.common.output",
    "drake_affetto.geometry.optics",
    "drake_affetto.pneumatics.chamber",
    "drake_affetto.pneumatics.flow",
    "drake_affetto.common.resources",
    "drake_affetto.geometry.kinematics",
    "drake_affetto.sensing.readings",
    "drake_affetto.skill.elm",
    "drake_affetto.sound.voice",
    "drake_affetto.teaching.stroke",
    *(f"drake_affetto.{stage}" for stage in STAGES),
}

MODULES = sorted(PACKAGE.rglob("*.py"))


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports(node: ast.AST, *, top_only: bool) -> Iterator[str]:
    """The modules that are imported; at the top of the file or anywhere."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.Import):
            yield from (alias.name for alias in child.names)
        elif isinstance(child, ast.ImportFrom):
            assert child.level == 0, "imports are absolute here"
            assert child.module is not None
            yield child.module
            # `from drake_affetto import cli` imports a module too.
            if child.module == "drake_affetto":
                for alias in child.names:
                    if not alias.name.startswith("_"):
                        yield f"drake_affetto.{alias.name}"
        elif isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(
            child.test
        ):
            if not top_only:
                yield from imports(child, top_only=False)
        elif not top_only or not isinstance(
            child, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)
        ):
            yield from imports(child, top_only=top_only)


def place(module: str) -> str:
    """The stage or module of drake_affetto in which `module` stands."""
    return module.split(".")[1] if "." in module else ""


@pytest.mark.parametrize("path", MODULES, ids=module_name)
def test_imports_run_one_way(path):
    own = place(module_name(path))
    assert own in RANK, f"{path.name} needs a place in ORDER"
    if path == PACKAGE / "__init__.py":
        # The package's own face names what it imports when it is used.
        return
    for module in imports(ast.parse(path.read_text()), top_only=False):
        if module.split(".")[0] != "drake_affetto":
            assert module != "pydrake.all", "name what is needed"
            continue
        there = place(module)
        assert there in RANK, f"{module} needs a place in ORDER"
        assert RANK[there] <= RANK[own], f"{own} imports the later {there}"


@functools.cache
def import_graph() -> dict[str, set[str]]:
    """For each module of the package those that it imports, anywhere."""
    known = set(map(module_name, MODULES))
    graph = {}
    for path in MODULES:
        wanted = set()
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                wanted |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                for alias in node.names:
                    inner = f"{node.module}.{alias.name}"
                    wanted.add(inner if inner in known else node.module)
        own = module_name(path)
        graph[own] = (wanted & known) - {own}
    return graph


def circles(graph: dict[str, set[str]]) -> list[list[str]]:
    """Groups of modules that import each other (Tarjan)."""
    number: dict[str, int] = {}
    lowest: dict[str, int] = {}
    stack: list[str] = []
    found = []

    def visit(module: str) -> None:
        number[module] = lowest[module] = len(number)
        stack.append(module)
        for other in graph[module]:
            if other not in number:
                visit(other)
                lowest[module] = min(lowest[module], lowest[other])
            elif other in stack:
                lowest[module] = min(lowest[module], number[other])
        if lowest[module] == number[module]:
            group = stack[stack.index(module) :]
            del stack[stack.index(module) :]
            if len(group) > 1:
                found.append(sorted(group))

    for module in graph:
        if module not in number:
            visit(module)
    return found


def test_search_for_circles_finds_them():
    graph = {"a": {"b"}, "b": {"c"}, "c": {"a", "d"}, "d": {"e"}, "e": set()}
    assert circles(graph) == [["a", "b", "c"]]


def test_no_modules_import_each_other_in_a_circle():
    assert circles(import_graph()) == []


def test_runner_knows_no_robot():
    for module, others in import_graph().items():
        if place(module) == "runner":
            assert {place(other) for other in others} <= {"runner", "common"}


def test_picture_of_the_rooms_shows_the_imports():
    source = (ROOT / "docs/rooms.dot").read_text()
    drawn = set(re.findall(r"^(\w+) -> (\w+)$", source, re.MULTILINE))
    nodes = set(re.findall(r"^(\w+) \[fillcolor", source, re.MULTILINE))
    imported: dict[str, set[str]] = {}
    for module, others in import_graph().items():
        # The modules at the top only hand on what rooms offer.
        if (PACKAGE / place(module)).is_dir() and place(module):
            imported.setdefault(place(module), set()).update(map(place, others))
    imported = {
        room: {other for other in others if other in imported} - {room}
        for room, others in imported.items()
    }
    assert nodes == set(imported), "make rooms"
    assert all(there in imported[room] for room, there in drawn), "make rooms"
    # What is not drawn follows from what is.
    reached = {room: {b for a, b in drawn if a == room} for room in imported}
    for _ in imported:
        for others in reached.values():
            others.update(*(reached[other] for other in set(others)))
    for room, others in imported.items():
        assert others <= reached[room], "make rooms"
    picture = (ROOT / "docs/rooms.svg").read_text()
    titles = set(re.findall(r"<title>(\w+)&#45;&gt;(\w+)</title>", picture))
    assert titles == drawn, "make rooms"


@pytest.mark.parametrize("path", MODULES, ids=module_name)
def test_every_module_says_what_it_is(path):
    assert ast.get_docstring(ast.parse(path.read_text()))


def test_every_folder_with_code_is_a_package():
    folders = {path.parent for path in MODULES}
    assert all((folder / "__init__.py").is_file() for folder in folders)


def test_mathematics_import_without_drake():
    modules = set(DRAKE_FREE)
    for path in MODULES:
        top = set(imports(ast.parse(path.read_text()), top_only=True))
        drake = any(name.split(".")[0] == "pydrake" for name in top)
        # The world's mathematics are Drake's own; the stages after it have
        # theirs apart.
        if place(module_name(path)) in set(STAGES) - {"scene"} and not drake:
            modules.add(module_name(path))
    code = (
        "import importlib, sys\n"
        "sys.modules['pydrake'] = None\n"
        f"for name in {sorted(modules)!r}:\n"
        "    try:\n"
        "        importlib.import_module(name)\n"
        "    except ImportError as error:\n"
        "        print(f'{name}: {error}')\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    assert (done.stdout, done.stderr, done.returncode) == ("", "", 0)


# What ties a file to one machine, put together so as not to name it here.
_PLACES = "|".join(("home", "root", "work", "Users", "tmp", "opt", "mnt"))
# A package comes by its name from wherever the machine is set up to look.
_SOURCES = "index[-_]" + "url|find[-_]" + "links"
FOREIGN = re.compile(rf"(?<![\w.$~}}*/:-])/(?:{_PLACES})/\w|{_SOURCES}")


def test_no_file_names_a_machine_or_a_package_host():
    if shutil.which("git") is None or not (ROOT / ".git").exists():
        pytest.skip("not a git checkout")
    listed = subprocess.run(
        ["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True
    )
    found = []
    for name in os.fsdecode(listed.stdout).split("\0"):
        path = ROOT / name
        if not name or not path.is_file():
            continue
        try:
            text = path.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            continue
        for number, line in enumerate(text.splitlines(), start=1):
            if FOREIGN.search(line):
                found.append(f"{name}:{number}: {line.strip()[:100]}")
    assert found == []


# --- Sizes, and the language of the code ------------------------------------

# Longer ones need a reason: "Long: ..." in the docstring of the module or of
# the function; compiled kernels are long for speed.
LONGEST_MODULE = 600
LONGEST_BODY = 80


def gives_a_reason(node: ast.AST) -> bool:
    return "Long: " in (ast.get_docstring(node) or "")


@pytest.mark.parametrize("path", MODULES, ids=module_name)
def test_modules_are_short_or_say_why_not(path):
    text = path.read_text()
    length = len(text.splitlines())
    assert length <= LONGEST_MODULE or gives_a_reason(ast.parse(text)), length


def body_length(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines of a function without its signature and docstring."""
    body = function.body
    if ast.get_docstring(function) is not None:
        body = body[1:]
    if not body:
        return 0
    assert function.end_lineno is not None
    return function.end_lineno - body[0].lineno + 1


@pytest.mark.parametrize("path", MODULES, ids=module_name)
def test_functions_are_short_or_compiled_or_say_why_not(path):
    long = []
    for node in ast.walk(ast.parse(path.read_text())):
        if not isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            continue
        compiled = any("njit" in ast.unparse(d) for d in node.decorator_list)
        excused = compiled or gives_a_reason(node)
        if body_length(node) > LONGEST_BODY and not excused:
            long.append(f"{node.name}: {body_length(node)} lines")
    assert long == []


def test_there_is_one_alias_for_arrays():
    homes = [
        path.relative_to(PACKAGE).as_posix()
        for path in MODULES
        if re.search(r"(?m)^\w*Array = ", path.read_text())
    ]
    assert homes == ["common/typing.py"]


# Drake's spelling is American. The scenario's value `centre` is older.
BRITISH = re.compile(
    r"(?<![a-z])(?:centr(?:e|es|ed|ing)|colou?r(?<=our)\w*|grey|"
    r"neighbour\w*|behaviour\w*|favour\w*|metres?|centimetres?|labelled|"
    r"modelled|(?:normal|synthes|initial|minim|optim|organ|recogn|summar|"
    r"parameter|linear|discret|random|standard|visual|serial|quant)is"
    r"(?:e|es|ed|er|ing|ation)|analys(?:e|ed)|licence)(?![a-z])",
    re.IGNORECASE,
)
OLD_VALUES = re.compile(r"""["'`]centre["'`]|mode: centre|n_labelled""")


@pytest.mark.parametrize(
    ("search", "text", "found"),
    [
        (FOREIGN, "see " + "/ho" + "me/someone/file", True),
        (FOREIGN, '"' + "/wo" + 'rk/shared"', True),
        (FOREIGN, "pip install --index" + "-url somewhere thing", True),
        (FOREIGN, "../shared/DESIGN.md", False),
        (FOREIGN, "models/work/part.sdf", False),
        (FOREIGN, "package://drake_affetto/sdf/x.sdf", False),
        (FOREIGN, "$HOME/root/file", False),
        (FOREIGN, "/usr/bin/python3.11", False),
        (BRITISH, "the colour of", True),
        (BRITISH, "normalised", True),
        (BRITISH, "_centre_of", True),
        (BRITISH, "color, center and normalize", False),
        (BRITISH, "precise analysis of parameters", False),
    ],
)
def test_searches_find_what_they_should(search, text, found):
    assert bool(search.search(text)) == found


def test_spelling_is_american():
    found = []
    for folder in ("drake_affetto", "analysis", "tools"):
        for path in sorted((ROOT / folder).rglob("*.py")):
            lines = path.read_text().splitlines()
            for number, line in enumerate(lines, start=1):
                if BRITISH.search(OLD_VALUES.sub("", line)):
                    place = path.relative_to(ROOT).as_posix()
                    found.append(f"{place}:{number}: {line.strip()[:70]}")
    assert found == []


# --- Tests beside the code ---------------------------------------------------

TESTS = ROOT / "tests"

# Modules, or folders of them, whose tests stand in another file than their own:
# parts of one thing, which is tested as a whole there.
TESTED_IN = {
    "cli/drum": "cli/test_study_command.py",
    "cli/identify": "identification/test_study.py",
    "cli/serve": "robot/test_server.py",
    "cli/tune": "tuning/test_study.py",
    "envs/scene_picture": "envs/test_drum.py",
    "experiments/calibration_media": (
        "experiments/test_self_calibration_study.py"
    ),
    "experiments/fault_injection": "experiments/test_watched.py",
    "experiments/media": "experiments/test_demo.py",
    "experiments/results": "experiments/results/test_study.py",
    "faults/camera_faults": "station/test_fault_wiring.py",
    "faults/fault_source": "station/test_fault_wiring.py",
    "faults/supervisor": "station/test_fault_wiring.py",
    "identification/plots": "identification/test_study.py",
    "identification/prediction": "identification/test_study.py",
    "identification/results": "identification/test_study.py",
    "motion/encoding": "motion/test_dmp.py",
    "motion/spring": "motion/test_dmp.py",
    "motion/stepping": "motion/test_dmp.py",
    "perception/config": "perception/test_mirror_camera.py",
    "perception/hue_gate": "perception/test_blob.py",
    "report/charts": "report/test_page.py",
    "report/parts": "report/test_page.py",
    "report/report_data": "report/test_page.py",
    "report/sections": "report/test_page.py",
    "robot/recording": "robot/test_server.py",
    "robot/simulated_robot": "robot/test_server.py",
    "runner/progress": "runner/test_executor.py",
    "station/gaze_turn": "station/test_station.py",
    "skill/optical": "perception/test_optical_map.py",
    "skill/residuals": "skill/test_transfer.py",
    "skill/search": "skill/test_transfer.py",
    "sound/modes": "sound/test_voice.py",
    "sound/ringing": "sound/test_voice.py",
    "sound/voice_config": "sound/test_voice.py",
    "tuning/evaluation": "tuning/test_study.py",
    "tuning/results": "tuning/test_study.py",
    "tuning/trial": "tuning/test_study.py",
}

# Further tests of a module, which need something else: a browser, rendered
# images, the files of the models.
MORE_TESTS = {
    "experiments/test_protocol.py": "experiments/mirror",
    "experiments/test_workspace_images.py": "experiments/workspace",
    "report/test_browser.py": "report/page",
    "report/test_self_calibration.py": "report/page",
    "robot/test_robot_software.py": "robot/log",
    "scene/test_contact.py": "scene/world",
    "scene/test_models.py": "scene/world",
    "scene/test_world_frames.py": "scene/world",
}


def in_rooms(root: Path, pattern: str) -> dict[str, Path]:
    """The files of the rooms' folders: "skill/elm" or "skill/test_elm.py"."""
    rooms = [path.name for path in PACKAGE.iterdir() if path.is_dir()]
    return {
        path.relative_to(root).as_posix(): path
        for room in rooms
        for path in (root / room).rglob(pattern)
    }


def own_test(module: str) -> str:
    folder, _, name = module.rpartition("/")
    return f"{folder}/test_{name}.py"


def has_code(path: Path) -> bool:
    kinds = (ast.FunctionDef, ast.ClassDef)
    return any(
        isinstance(node, kinds) for node in ast.parse(path.read_text()).body
    )


def imported_names(path: Path) -> set[str]:
    """Modules that a file imports, and what it imports from them."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module is not None:
            found.add(node.module)
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def reached(test: Path) -> set[str]:
    """What of the package a test imports, itself or through others."""
    files = [test, test.with_name("conftest.py")]
    wanted = set().union(*(imported_names(f) for f in files if f.is_file()))
    for path in (TESTS / "support").glob("*.py"):
        if f"support.{path.stem}" in wanted:
            wanted |= imported_names(path)
    graph = dict(import_graph())
    # The command imports a command, and the package's face a room, by its name.
    graph["drake_affetto.cli.main"] = {
        module for module in graph if place(module) == "cli"
    }
    del graph["drake_affetto"]
    waiting = wanted & set(graph)
    found: set[str] = set()
    while waiting:
        module = waiting.pop()
        found.add(module)
        waiting |= (graph[module] & set(graph)) - found
    return found


def modules_with_code() -> dict[str, Path]:
    """Those that have something to test, as "skill/elm"."""
    return {
        name.removesuffix(".py"): path
        for name, path in in_rooms(PACKAGE, "[!_]*.py").items()
        if has_code(path)
    }


def untested_in(entry: str) -> list[str]:
    """Modules without a file of tests that a module or folder stands for."""
    return [
        module
        for module in modules_with_code()
        if entry in (module, module.rpartition("/")[0])
        and not (TESTS / own_test(module)).is_file()
    ]


def test_every_module_with_code_has_its_tests():
    covered = {each for entry in TESTED_IN for each in untested_in(entry)}
    missing = {
        module
        for module in modules_with_code()
        if not (TESTS / own_test(module)).is_file()
    }
    assert missing == covered


def test_every_test_has_its_module():
    known = {own_test(module) for module in modules_with_code()}
    assert set(in_rooms(TESTS, "test_*.py")) - known == set(MORE_TESTS)


@pytest.mark.parametrize(("entry", "test"), TESTED_IN.items())
def test_tests_of_a_neighbor_import_what_they_stand_for(entry, test):
    modules = untested_in(entry)
    assert modules, "an entry that is not needed"
    names = {f"drake_affetto.{each.replace('/', '.')}" for each in modules}
    assert names <= reached(TESTS / test)


@pytest.mark.parametrize(("test", "module"), MORE_TESTS.items())
def test_further_tests_import_their_module(test, module):
    assert f"drake_affetto.{module.replace('/', '.')}" in reached(TESTS / test)
