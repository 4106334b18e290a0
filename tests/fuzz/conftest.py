"""Attacks watch time, memory and the compiler in the way that Linux offers."""

import sys

collect_ignore_glob = [] if sys.platform == "linux" else ["test_*.py"]
