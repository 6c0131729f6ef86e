"""`python -m kinetostat` is the command."""

import sys

from kinetostat.cli import main

sys.exit(main())
