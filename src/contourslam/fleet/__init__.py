"""Several robots at once: what each tells of its map, and the server that joins them as they meet."""
