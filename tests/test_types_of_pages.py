"""The Python of README and docs passes pyright in its strict mode, as in the editor of a user."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from test_docs import PAGES, RECIPES, ROOT, blocks

UNTYPED = ("torch", "jax", "mujoco", "pydrake", "zarr", "scipy", "numba", r"planarfriction\.kernels", *RECIPES)
"""What has no types, or half of them, and compiled loops: what stands behind the import is not judged."""
OWN = (
    "reportMissingParameterType",
    "reportUnknownArgumentType",
    "reportUnknownLambdaType",
    "reportUnknownParameterType",
    "reportUnknownVariableType",
    "reportPossiblyUnbound",
    "reportPossiblyUnboundVariable",
    "reportUnusedImport",
    "reportMissingTypeStubs",
)
"""What a page itself leaves out: functions without types, loops that run at least once."""

pytestmark = pytest.mark.skipif(not (ROOT / "docs").is_dir(), reason="no docs beside these tests")


def judged(page: Path) -> str:
    """The Python of a page up to the first import of something without types, on the lines where it stands."""
    lines: list[str] = []
    for block in blocks(page):
        if re.search(rf"^\s*(import|from) (planarfriction\.(adapters\.)?)?({'|'.join(UNTYPED)})\b", block.text, re.M):
            break
        if block.language == "python":
            lines += [""] * (block.line - 1 - len(lines)) + block.text.splitlines()
    return "\n".join(lines) + "\n"


def counts(diagnostic: dict, code: str) -> bool:
    """Whether the library is to blame: not for members of what a page defines, nor for lists that begin empty.

    Formulas, which take NumPy, PyTorch or JAX and are compiled as they stand, have no types.
    """
    if diagnostic["severity"] != "error" or "(xp: Unknown" in diagnostic["message"]:
        return False
    if diagnostic.get("rule") != "reportUnknownMemberType":
        return True
    match = re.match(r'Type of "(\w+)" is partially unknown', diagnostic["message"])
    return match is not None and match[1] != "append" and f"def {match[1]}(" not in code


@pytest.mark.slow
def test_pyright_accepts_the_python_of_every_page(tmp_path):
    pyright = shutil.which("pyright") or shutil.which("pyright", path=Path(sys.executable).parent)
    if pyright is None:
        pytest.skip("needs pyright, of the extra [dev]")
    settings = {"typeCheckingMode": "strict", **dict.fromkeys(OWN, False)}
    (tmp_path / "pyrightconfig.json").write_text(json.dumps(settings))
    codes = {f"{page.stem.lower().replace('-', '_')}_page.py": judged(page) for page in PAGES}
    codes = {name: code for name, code in codes.items() if code.strip()}
    assert len(codes) > 20
    for name, code in codes.items():
        (tmp_path / name).write_text(code, encoding="utf-8")
    # as an installed package: only what is public by the rules of typed packages may be imported
    where = {**os.environ, "PYTHONPATH": str(ROOT / "src")}
    command = [str(pyright), "--outputjson", "--pythonpath", sys.executable]
    run = subprocess.run(command, cwd=tmp_path, env=where, capture_output=True, text=True, check=False)
    found = json.loads(run.stdout)
    assert found["summary"]["filesAnalyzed"] == len(codes)
    wrong = [
        f"{Path(each['file']).name}, line {each['range']['start']['line'] + 1}: {each['message']}"
        for each in found["generalDiagnostics"]
        if counts(each, codes[Path(each["file"]).name])
    ]
    assert not wrong, "\n".join(wrong)
