"""The command line: one module per command, each a thin shell around the library."""

from contourslam.cli.entry import main

__all__ = ["main"]
