"""By how much the actuators of a loaded machine must be corrected over a grid, and the law of these corrections."""
