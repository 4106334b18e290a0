"""Distributions that `make dist` refuses: files missing or too many, another version, a wheel that grows."""

import io
import json
import re
import tarfile
import tomllib
import zipfile

import pytest

import planarfriction
from tests.support.repository import ROOT, script

check = script(".ci/check_dist.py")
KIND = check.DISTRIBUTIONS["planarfriction"]
CODE = {"planarfriction/__init__.py", "planarfriction/py.typed"}


def wheel(folder, names, content=b""):
    """Write a wheel with these files and all licences."""
    folder.mkdir()
    path = folder / "planarfriction-1.2.3-py3-none-any.whl"
    licences = {
        f"planarfriction-1.2.3.dist-info/licenses/{name}" for name in KIND.licences
    }
    with zipfile.ZipFile(path, "w") as archive:
        for name in sorted(names | licences):
            archive.writestr(name, content)
    return path


def source(folder, names):
    """Write a source distribution with these files."""
    path = folder / "planarfriction-1.2.3.tar.gz"
    with tarfile.open(path, "w:gz") as archive:
        for name in sorted(
            names | {"PKG-INFO", "setup.cfg", "src/planarfriction.egg-info/SOURCES.txt"}
        ):
            archive.addfile(
                tarfile.TarInfo(f"planarfriction-1.2.3/{name}"), io.BytesIO()
            )
    return path


def faults(folder, *, code=CODE, beside=frozenset(), **options):
    """Lines about a release that has these files."""
    sent = source(folder, {f"src/{name}" for name in code} | KIND.beside | beside)
    return check.faults(
        KIND,
        sent,
        wheel(folder / "a", code),
        wheel(folder / "b", code),
        CODE,
        **options,
    )


def test_a_release_has_the_tracked_files_and_its_tag(tmp_path):
    assert faults(tmp_path, tag="v1.2.3") == []


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (
            {"code": CODE - {"planarfriction/py.typed"}},
            "missing from the wheel: planarfriction/py.typed",
        ),
        ({"code": CODE | {"tests/test_a.py"}}, "in the wheel only: tests/test_a.py"),
        (
            {"beside": {"tests/test_a.py"}},
            "in the source distribution only: tests/test_a.py",
        ),
        (
            {"tag": "v1.2.4"},
            "the tag v1.2.4 is not the version of planarfriction-1.2.3-py3-none-any.whl",
        ),
    ],
)
def test_what_does_not_belong_is_named(tmp_path, options, words):
    assert words in faults(tmp_path, **options)


def test_wheels_that_differ_or_grow_are_named(tmp_path):
    sent = source(tmp_path, {f"src/{name}" for name in CODE} | KIND.beside)
    small = KIND._replace(most=100.0)
    found = check.faults(
        small,
        sent,
        wheel(tmp_path / "a", CODE),
        wheel(tmp_path / "b", CODE, b"more"),
        CODE,
    )
    assert any(
        line.startswith("not the same in a wheel") and "py.typed" in line
        for line in found
    )
    assert any(line.startswith("the wheel has ") for line in found)


def test_the_version_is_the_same_everywhere():
    library, studies = (
        tomllib.loads((ROOT / folder / "pyproject.toml").read_text(encoding="utf-8"))[
            "project"
        ]
        for folder in (".", "studies")
    )
    assert library["version"] == studies["version"] == planarfriction.__version__
    assert studies["dependencies"] == [f"planarfriction=={planarfriction.__version__}"]
    assert f"\nversion: {planarfriction.__version__}\n" in (
        ROOT / "CITATION.cff"
    ).read_text(encoding="utf-8")
    deposit = json.loads((ROOT / ".zenodo.json").read_text(encoding="utf-8"))
    assert deposit["version"] == planarfriction.__version__
    newest = re.search(
        r"^## (\S+)", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE
    )
    assert newest and newest[1] == planarfriction.__version__


def test_the_conda_recipe_needs_what_the_project_needs():
    yaml = pytest.importorskip("yaml")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))[
        "project"
    ]
    recipe = yaml.safe_load(
        (ROOT / "recipe" / "recipe.yaml").read_text(encoding="utf-8")
    )
    called = {"lazy_loader": "lazy-loader", "matplotlib": "matplotlib-base"}  # there
    needs = [each.partition(">=") for each in project["dependencies"]]
    wanted = [f"{called.get(name, name)} >={version}" for name, _, version in needs]
    assert recipe["requirements"]["run"] == [
        f"python {project['requires-python']}",
        *wanted,
    ]
    assert recipe["context"]["version"] == project["version"]
    assert recipe["about"]["license_file"] == project["license-files"]
    assert recipe["build"]["python"]["entry_points"] == [
        f"{a} = {b}" for a, b in project["scripts"].items()
    ]


def test_this_repository_has_what_a_release_needs():
    for kind in check.DISTRIBUTIONS.values():
        assert any(
            name.endswith("/__init__.py") for name in check.tracked(ROOT / kind.folder)
        )
        assert all((ROOT / kind.folder / name).is_file() for name in kind.beside)
    assert check.tracked(ROOT) >= CODE
    assert (ROOT / "LICENSE").read_bytes() == (
        ROOT / "studies" / "LICENSE"
    ).read_bytes()


@pytest.mark.parametrize("version", [(3, 9, 18), (3, 10, 13), (3, 11, 0)])
def test_an_old_python_is_told_before_anything_is_downloaded(version, monkeypatch):
    monkeypatch.setattr("sys.version_info", version)
    if version >= (3, 11):
        assert script("build_backend.py").get_requires_for_build_wheel() == [
            "setuptools>=77"
        ]
    else:
        with pytest.raises(SystemExit, match=r"needs Python 3\.11 or later"):
            script("build_backend.py")
    built = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))[
        "build-system"
    ]
    assert built["requires"] == [] and built["build-backend"] == "build_backend"
