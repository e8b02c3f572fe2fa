"""The parts of the comparison's page: one module a section, over a few pieces of HTML."""
