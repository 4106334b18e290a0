"""Builds with setuptools; too old a Python is told so before an installer downloads anything."""

import contextlib
import sys

if sys.version_info < (3, 11):  # noqa: UP036 (any Python may read this)
    sys.exit(
        f"planarfriction needs Python 3.11 or later: {sys.executable} is {sys.version.split()[0]}"
    )

with contextlib.suppress(
    ImportError
):  # an installer asks what to install before it builds
    from setuptools.build_meta import *  # noqa: F403


def get_requires_for_build_wheel(config_settings=None):
    """Return what the build needs."""
    return ["setuptools>=77"]


get_requires_for_build_editable = get_requires_for_build_sdist = (
    get_requires_for_build_wheel
)


def build_editable(*arguments, **options):
    """Build with setuptools; installers look for this function before setuptools is there."""
    from setuptools import build_meta

    return build_meta.build_editable(*arguments, **options)
