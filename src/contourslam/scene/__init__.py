"""The 3-D scene: surfaces of a map raised from the floor, coloured from the pictures taken along the way, as glTF."""
