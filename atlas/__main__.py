"""`python -m towatlas`."""

import sys

from towatlas.cli import main

sys.exit(main())
