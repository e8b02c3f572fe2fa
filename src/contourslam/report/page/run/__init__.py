"""The sections of the page of one run; each gives None where the run has nothing to show in it."""
