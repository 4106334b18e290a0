"""Models as source code for programs that carry no Python."""

from planarfriction.export.library import export_c as export_c
