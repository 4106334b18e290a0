"""The floors of the three packages: imports only go down, and the import of the library is light.

The floors are those of the import-linter contracts in pyproject.toml, read here so that the tests need no extra.
"""

import ast
import functools
import importlib
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from planarfriction._engine.compiler import FOLDERS
from planarfriction._support.pictures import PICTURES

ROOT = Path(__file__).parents[2]
ENGINE = "planarfriction._engine"
LIBRARY, STUDIES, EXPLORER = (
    "planarfriction",
    "planarfriction_studies",
    "planarfriction_explorer",
)
SOURCES = {
    LIBRARY: ROOT / "src",
    STUDIES: ROOT / "studies" / "src",
    EXPLORER: ROOT / "src",
}
HEAVY = (
    "PIL",
    "click",
    "jax",
    "jinja2",
    "llvmlite",
    "matplotlib",
    "mujoco",
    "numba",
    "pandas",
    "pydrake",
    "rich",
    "scipy",
    "shapely",
    "torch",
    "warp",
    "xarray",
)
"""Packages that `import planarfriction` must not load."""

HOMES = {
    "numba": ("compiled",),
    "llvmlite": ("compiled",),
    "matplotlib": ("plots", "planarfriction_studies.rig"),
    "rich": ("cli",),
    "click": (
        "cli",
        "planarfriction_studies.commands",
        "planarfriction_explorer.command",
    ),
    "torch": ("torch",),
    "warp": ("warp",),
    "mujoco": ("adapters",),
    "pydrake": ("adapters",),
    "jax": ("jax",),
}
"""Package -> the floors whose modules may import it when they load; no floor may load the rest of HEAVY that way."""

SIMULATORS = {
    "planarfriction.adapters.mjx": "jax",
    "planarfriction.adapters.mujoco_warp": "warp",
}
"""Adapters of simulators that calculate with a package which has a floor of its own."""


def _contracts():
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    return settings["tool"]["importlinter"]["contracts"]


def _floors():
    """Module right below a package -> its floor, 0 at the bottom; modules on one floor do not see each other."""
    found = {}
    for contract in _contracts():
        homes = [f"{home}." for home in contract.get("containers", [])] or [""]
        for height, floor in enumerate(reversed(contract["layers"])):
            found |= {
                f"{home}{name.strip(' ()')}": height
                for home in homes
                for name in floor.split("|")
            }
    return found


def _module_name(file, folder):
    parts = file.relative_to(folder).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def _imports(tree, nested):
    """Dotted names that the code imports, `from a import b` as `a.b`; imports for type checkers do not count.

    With `nested`, the imports inside functions too; without, only those that run when the module loads.
    """
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are absolute"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif nested or not isinstance(
            node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)
        ):
            yield from _imports(node, nested)


COMPILED = [folder.replace("/", ".") for folder in FOLDERS]


def _is_compiled(module):
    return any(f"{module}.".startswith(f"planarfriction.{name}.") for name in COMPILED)


@functools.cache
def _sources():
    files = [
        (file, home)
        for package, home in SOURCES.items()
        for file in sorted((home / package).rglob("*.py"))
    ]
    return [
        (_module_name(file, home), ast.parse(file.read_text(encoding="utf-8")))
        for file, home in files
    ]


def _floor(module, words=2):
    """The first words of a name: two for the module right below its package, three for a room of the engine."""
    return ".".join(module.split(".")[:words])


def _upward_imports(sources):
    floors = _floors()
    found = []
    for module, tree in sources:
        package = module.split(".")[0]
        for target in _imports(tree, nested=True):
            goal = target.split(".")[0]
            if goal not in (LIBRARY, STUDIES, EXPLORER):
                continue
            if goal != package:
                wrong = floors[goal] >= floors[package]
            else:
                # a package itself, and an explorer without floors, may see all of its own
                words = 3 if _floor(module) == _floor(target) == ENGINE else 2
                own = _floor(module, words)
                seen = _floor(target, words)
                wrong = (
                    own != seen
                    and own in floors
                    and seen in floors
                    and floors[seen] >= floors[own]
                )
            if wrong:
                found.append(f"{module} -> {target}")
    return found


def _circle(sources):
    """Modules that import each other in a circle, also inside functions; packages themselves do not count."""
    names = {module for module, _ in sources}
    packages = {module.rpartition(".")[0] for module in names}
    imports = {}
    for module, tree in sources:
        seen = {
            target if target in names else target.rpartition(".")[0]
            for target in _imports(tree, nested=True)
        }
        imports[module] = (seen & names) - packages - {module}
    while leaves := {
        module for module in imports if not imports[module] & set(imports)
    }:
        imports = {
            module: seen for module, seen in imports.items() if module not in leaves
        }
    return sorted(imports)


def test_no_modules_import_each_other():
    assert (
        _circle([each for each in _sources() if not each[0].startswith(EXPLORER)]) == []
    )


def test_a_circle_is_found():
    first = (
        "planarfriction.geometry",
        ast.parse("def f():\n    from planarfriction.errors import FrictionError"),
    )
    second = ("planarfriction.errors", ast.parse("from planarfriction import geometry"))
    assert _circle([first, second]) == [second[0], first[0]]


def test_every_module_has_a_floor():
    floors = _floors()
    for module, _ in _sources():
        if "." in module and not module.startswith(EXPLORER):
            assert _floor(module) in floors, (
                f"{module}: add it to the layers in pyproject.toml"
            )


def test_maintainers_read_about_every_layer():
    page = (ROOT / "docs" / "maintaining.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (`[^|]+) \| [^|]+ \|$", page, re.MULTILINE)
    named = {name for row in rows for name in re.findall(r"`(\w+)`", row)}
    modules = [each.split(".") for each in _floors()]
    below = {each[1] for each in modules if each[0] == LIBRARY and len(each) == 2}
    assert below - named == set()
    assert len(below) > 20


def test_imports_only_go_down():
    assert _upward_imports(_sources()) == []


@pytest.mark.parametrize(
    "line",
    [
        "from planarfriction.scenes import Scene",
        "import planarfriction.scenes.solution",
        "from planarfriction import scenes",
        "def later():\n    from planarfriction.plots import plot_patch",
        "from planarfriction_studies import bench",
        "import planarfriction_explorer.page",
    ],
)
def test_an_import_that_goes_up_is_found(line):
    # The checker itself can fail: each of these lines in a model would be reported.
    assert len(_upward_imports([("planarfriction.models.new", ast.parse(line))])) == 1


@pytest.mark.parametrize(
    ("module", "line"),
    [
        (
            "planarfriction._engine.bristles.new",
            "from planarfriction._engine.cells import cells",
        ),
        (
            "planarfriction._engine.body.new",
            "from planarfriction._engine.coupled.steps import ready",
        ),
        (
            "planarfriction_studies.bench.new",
            "from planarfriction_studies.experiments import facts",
        ),
        (
            "planarfriction_studies.measured.new",
            "def later():\n    import planarfriction_studies.commands.bench",
        ),
        (
            "planarfriction_studies.measured.new",
            "from planarfriction_explorer.page import Page",
        ),
        (
            "planarfriction_explorer.page",
            "from planarfriction_studies.bench import run",
        ),
    ],
)
def test_an_import_between_packages_that_goes_up_is_found(module, line):
    assert len(_upward_imports([(module, ast.parse(line))])) == 1


def test_the_contracts_allow_no_exceptions():
    assert not [
        contract["name"] for contract in _contracts() if "ignore_imports" in contract
    ]


@pytest.mark.parametrize("name", PICTURES)
def test_every_picture_is_a_function_of_the_plots(name):
    module, _, function = PICTURES[name].partition(":")
    assert callable(
        getattr(importlib.import_module(f"planarfriction.plots.{module}"), function)
    )


def test_heavy_packages_load_only_where_they_live():
    for module, tree in _sources():
        floor = _floor(module).removeprefix(f"{LIBRARY}.")
        floor = "compiled" if _is_compiled(module) else floor
        for target in _imports(tree, nested=False):
            package = target.split(".")[0]
            adapted = any(
                module.startswith(name) and package == its
                for name, its in SIMULATORS.items()
            )
            if package in HEAVY and not adapted:
                assert floor in HOMES.get(package, ()), (
                    f"{module} imports {target} when it loads"
                )


def test_numba_stays_where_code_is_compiled():
    for module, tree in _sources():
        for target in _imports(tree, nested=True):
            assert target.split(".")[0] != "numba" or _is_compiled(module), (
                f"{module} imports {target}"
            )


def test_compiled_functions_stand_in_folders_that_the_digest_covers():
    decorators = {
        f"planarfriction._engine.compiler.{name}"
        for name in ("callback", "entry", "jit", "kernel")
    }
    using = [
        module
        for module, tree in _sources()
        if decorators & set(_imports(tree, nested=True))
    ]
    for name in COMPILED[1:]:
        assert [
            each for each in using if f"{each}.".startswith(f"planarfriction.{name}.")
        ], name
    # Hands them on.
    assert [module for module in using if not _is_compiled(module)] == [
        "planarfriction.extend"
    ]


def test_compiled_code_depends_on_nothing_outside_the_digest():
    # a constant of another file would stay in the machine code after a change of that file
    compiled = {
        "planarfriction.formulas",
        *(f"planarfriction.{name}" for name in COMPILED),
    }
    for module, tree in _sources():
        # Nothing of it is compiled.
        if _is_compiled(module) and not module.endswith("compiler.machine_code"):
            for target in _imports(tree, nested=True):
                inside = any(f"{target}.".startswith(f"{name}.") for name in compiled)
                assert inside or not target.startswith("planarfriction"), (
                    f"{module} imports {target}"
                )


def _loaded_after(code):
    program = f"import sys\n{code}\nprint(*sorted(sys.modules))"
    done = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    return {name.split(".")[0] for name in done.stdout.split()}


def test_import_of_the_package_is_light():
    assert not _loaded_after("import planarfriction") & set(HEAVY)


def test_describing_a_patch_and_a_scene_loads_no_heavy_package():
    code = "pf.ContactPatch.rectangle(0.02)\npf.LuGre()\npf.Signal.constant(1.0)\npf.Body(1.0, 1.0)"
    assert not _loaded_after(f"import planarfriction as pf\n{code}") & set(HEAVY)


def test_the_help_of_the_command_line_loads_no_numerics():
    code = "import contextlib, io\nwith contextlib.redirect_stdout(io.StringIO()):\n    main(['--help'])"
    loaded = _loaded_after(f"from planarfriction.cli import main\n{code}")
    assert not loaded & (set(HEAVY) - {"click"})


def test_a_run_that_writes_nothing_loads_no_datasets_and_no_pictures():
    # half a second of three; SciPy comes with Numba
    code = "import contextlib, io\nwith contextlib.redirect_stdout(io.StringIO()):\n    main(['run', 'in-hand'])"
    loaded = _loaded_after(f"from planarfriction.cli import main\n{code}")
    assert "numba" in loaded
    assert not loaded & {"PIL", "matplotlib", "pandas", "shapely", "xarray"}
