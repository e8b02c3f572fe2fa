"""Maps of one building that know nothing of each other: whether they overlap, how, and one map of them all."""
