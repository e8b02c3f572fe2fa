"""A room, a robot and a lidar in MuJoCo: runs with the truth about every step (needs the extra ``simulation``).

``simulate.simulate(rooms.ROOMS["furnished_room"], config.SimulationConfig(), seed)`` is the way in.
"""
