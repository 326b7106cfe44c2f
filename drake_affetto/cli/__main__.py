"""`python -m drake_affetto.cli` is the `affetto` command."""

import sys

from drake_affetto.cli.main import main

sys.exit(main())
