"""`python -m planarfriction`: the command line."""

import sys

from planarfriction.cli import main

sys.exit(main())
