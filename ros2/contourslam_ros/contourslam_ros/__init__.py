"""contourslam on a robot that runs ROS 2: thin nodes over ``contourslam.live``."""
