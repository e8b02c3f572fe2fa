"""Drawings of a run as SVG: written directly, because a run must not wait for a plotting library to be loaded."""
