"""Sweeps: recordings, rooms, noise, beams, seeds, detectors and settings, every combination once, on Dask.

``experiment`` reads the file, ``plan`` makes its runs, ``tasks`` cuts them into pieces for workers, ``work`` does one
run, ``store`` keeps its row, ``engine`` has them all done. They need the extra ``sweep``, simulated drives
``simulation`` too.
"""
