"""`python -m s3d_py` is the command `s3d`."""

import sys

from ._cli import main

sys.exit(main())
