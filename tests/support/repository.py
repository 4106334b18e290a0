"""Files of the repository beside the tests: its root, and its scripts as modules."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[2]


def script(path: str) -> ModuleType:
    """Import a script by its path in the repository, or skip the test where only the tests were copied."""
    file = ROOT / path
    if not file.exists():
        pytest.skip(f"no {path} beside these tests", allow_module_level=True)
    specification = importlib.util.spec_from_file_location(file.stem, file)
    assert specification is not None and specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    sys.modules[file.stem] = module  # records of the script look up their types there
    specification.loader.exec_module(module)
    return module
