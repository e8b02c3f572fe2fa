"""``python -m contourslam`` is the command line."""

import sys

from contourslam.cli import main

if __name__ == "__main__":
    sys.exit(main())
