"""Check what `make dist` built: each wheel has its tracked sources and licences, nothing else, and is small.

`python .ci/check_dist.py DIST DIRECT [TAG]`: folder with the source distributions and the wheels that were built from
them, folder with wheels that were built without them, and the tag of a release, `v` and the version.
"""

from __future__ import annotations

import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path
from typing import NamedTuple

PLAIN = {"LICENSE", "MANIFEST.in", "README.md", "pyproject.toml"}


class Distribution(NamedTuple):
    """Distribution that this repository makes."""

    folder: str
    """Folder of its pyproject.toml."""
    beside: set[str]
    """Files of the source distribution that are no sources."""
    licences: set[str]
    """Names of the licence files of the wheel."""
    most: float
    """Size [bytes] below which the wheel stays."""


DISTRIBUTIONS = {
    "planarfriction": Distribution(
        ".",
        PLAIN | {"CHANGELOG.md", "CITATION.cff", "build_backend.py"},
        {"LICENSE"},
        1.0e6,
    ),
    "planarfriction_studies": Distribution(
        "studies", PLAIN, {"LICENSE", "LICENSE-APACHE-2.0.txt", "NOTICE"}, 2.0e6
    ),
}
"""Distributions by the name with which their files begin."""


def tracked(folder: str) -> set[str]:
    """Return the sources of a distribution that belong to the repository, `planarfriction/laws/base.py`."""
    listed = subprocess.run(
        ["git", "ls-files", "src"],
        cwd=folder,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    return {line.removeprefix("src/") for line in listed.splitlines()}


def contents(wheel: Path) -> dict[str, bytes]:
    """Return the files of a wheel by name."""
    with zipfile.ZipFile(wheel) as archive:
        return {
            name: archive.read(name)
            for name in archive.namelist()
            if not name.endswith("/")
        }


def source_names(source: Path) -> set[str]:
    """Return the names of the files of a source distribution, without its folder and what setuptools adds."""
    with tarfile.open(source) as archive:
        names = {
            each.name.partition("/")[2]
            for each in archive.getmembers()
            if each.isfile()
        }
    return {
        name
        for name in names
        if ".egg-info/" not in name and name not in ("PKG-INFO", "setup.cfg")
    }


def faults(
    kind: Distribution,
    source: Path,
    wheel: Path,
    direct: Path,
    sources: set[str],
    tag: str | None = None,
) -> list[str]:
    """Return one line for each thing that is wrong with a distribution."""
    files = contents(wheel)
    found = []
    code = {name for name in files if ".dist-info/" not in name}
    licences = {
        name.rpartition("/")[2] for name in files if ".dist-info/licenses/" in name
    }
    wanted = {f"src/{name}" for name in sources} | kind.beside
    for what, differing in (
        ("missing from the wheel", sources - code),
        ("in the wheel only", code - sources),
        ("missing from the licences of the wheel", kind.licences - licences),
        ("missing from the source distribution", wanted - source_names(source)),
        ("in the source distribution only", source_names(source) - wanted),
    ):
        found += [f"{what}: {name}" for name in sorted(differing)]
    again = contents(direct)
    changed = sorted(
        name
        for name in files.keys() | again.keys()
        if files.get(name) != again.get(name)
    )
    found += [
        f"not the same in a wheel that was built without the source distribution: {name}"
        for name in changed
    ]
    if (size := wheel.stat().st_size) >= kind.most:
        found.append(f"the wheel has {size} bytes, more than {kind.most:g}")
    if tag is not None and tag != f"v{wheel.name.split('-')[1]}":
        found.append(f"the tag {tag} is not the version of {wheel.name}")
    return found


def main(dist: str, direct: str, tag: str | None = None) -> int:
    """Print what is wrong, or what was built; return the exit code."""
    code = 0
    for name, kind in DISTRIBUTIONS.items():
        (source,) = Path(dist).glob(f"{name}-*.tar.gz")
        (wheel,) = Path(dist).glob(f"{name}-*.whl")
        (again,) = Path(direct).glob(f"{name}-*.whl")
        wrong = faults(kind, source, wheel, again, tracked(kind.folder), tag)
        print(
            "\n".join(wrong)
            or f"{wheel.name}: {wheel.stat().st_size / 1e6:.2f} MB, {len(contents(wheel))} files"
        )
        code |= bool(wrong)
    return code


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
