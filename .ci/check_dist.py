"""Check what `make dist` built: the wheel has the tracked sources and the licences, nothing else, and is small.

`python .ci/check_dist.py DIST DIRECT [TAG]`: folder with the source distribution and the wheel that was built from it,
folder with a wheel that was built without it, and the tag of a release, `v` and the version.
"""

from __future__ import annotations

import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

MAX_WHEEL = 2.5e6
"""Size [bytes] above which the studies with their data become a distribution of their own."""

BESIDE = {"CHANGELOG.md", "CITATION.cff", "LICENSE", "MANIFEST.in", "README.md", "pyproject.toml"}
"""Files of the source distribution that are no sources."""

LICENCES = {"LICENSE", "LICENSE-APACHE-2.0.txt", "NOTICE"}
"""Names of the licence files of a wheel."""


def tracked() -> set[str]:
    """Return the sources that belong to the repository, `planarfriction/laws/base.py`."""
    listed = subprocess.run(["git", "ls-files", "src"], capture_output=True, text=True, check=True).stdout
    return {line.removeprefix("src/") for line in listed.splitlines()}


def contents(wheel: Path) -> dict[str, bytes]:
    """Return the files of a wheel by name."""
    with zipfile.ZipFile(wheel) as archive:
        return {name: archive.read(name) for name in archive.namelist() if not name.endswith("/")}


def source_names(source: Path) -> set[str]:
    """Return the names of the files of a source distribution, without its folder and what setuptools adds."""
    with tarfile.open(source) as archive:
        names = {each.name.partition("/")[2] for each in archive.getmembers() if each.isfile()}
    return {name for name in names if ".egg-info/" not in name and name not in ("PKG-INFO", "setup.cfg")}


def faults(source: Path, wheel: Path, direct: Path, sources: set[str], tag: str | None = None) -> list[str]:
    """Return one line for each thing that is wrong with the distributions."""
    files, found = contents(wheel), []
    code = {name for name in files if ".dist-info/" not in name}
    licences = {name.rpartition("/")[2] for name in files if ".dist-info/licenses/" in name}
    wanted = {f"src/{name}" for name in sources} | BESIDE
    for what, differing in (
        ("missing from the wheel", sources - code),
        ("in the wheel only", code - sources),
        ("missing from the licences of the wheel", LICENCES - licences),
        ("missing from the source distribution", wanted - source_names(source)),
        ("in the source distribution only", source_names(source) - wanted),
    ):
        found += [f"{what}: {name}" for name in sorted(differing)]
    again = contents(direct)
    changed = sorted(name for name in files.keys() | again.keys() if files.get(name) != again.get(name))
    found += [f"not the same in a wheel that was built without the source distribution: {name}" for name in changed]
    if (size := wheel.stat().st_size) >= MAX_WHEEL:
        found.append(f"the wheel has {size} bytes, more than {MAX_WHEEL:g}")
    if tag is not None and tag != f"v{wheel.name.split('-')[1]}":
        found.append(f"the tag {tag} is not the version of {wheel.name}")
    return found


def main(dist: str, direct: str, tag: str | None = None) -> int:
    """Print what is wrong, or what was built; return the exit code."""
    (source,), (wheel,), (again,) = Path(dist).glob("*.tar.gz"), Path(dist).glob("*.whl"), Path(direct).glob("*.whl")
    wrong = faults(source, wheel, again, tracked(), tag)
    print("\n".join(wrong) or f"{wheel.name}: {wheel.stat().st_size / 1e6:.2f} MB, {len(contents(wheel))} files")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
