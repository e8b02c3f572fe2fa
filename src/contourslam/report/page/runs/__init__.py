"""The sections of the page that holds runs against each other; each gives None where there is nothing to show in it."""
