"""Rooms and the robot for Gazebo, as SDF: :func:`contourslam.simulation.gazebo.world.gazebo_world` is the way in."""
