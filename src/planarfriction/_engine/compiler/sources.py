"""Sources that machine code may be made from, with one digest of all."""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Iterable
from pathlib import Path

import llvmlite
import numba
import numpy as np


def digest_of(file: Path) -> str | None:
    """Return the digest of a file; None if it cannot be read."""
    try:
        return hashlib.sha256(file.read_bytes()).hexdigest()
    except OSError:  # typed into a prompt
        return None


class Sources:
    """Files of a package that machine code depends on, as they were when they were imported."""

    def __init__(self, root: Path, files: Iterable[Path]) -> None:
        self.root = root
        self.files = sorted(files)
        self.digest = self._digest_now()

    def _digest_now(self) -> str | None:
        versions = (
            numba.__version__,
            llvmlite.__version__,
            np.__version__,
            sys.implementation.cache_tag,
        )
        parts = [
            repr(versions),
            *((self.name_of(file), digest_of(file)) for file in self.files),
        ]
        # Inside an archive, or installed without its sources.
        if not all(map(all, parts[1:])):
            return None
        return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]

    def name_of(self, file: Path) -> str:
        """Return the name of one of the files within the package, which is the same wherever it is installed."""
        return (
            file.relative_to(self.root).as_posix() if file in self.files else str(file)
        )

    def unchanged(self) -> bool:
        """Return True if no source file changed since import."""
        return self.digest is not None and self.digest == self._digest_now()
