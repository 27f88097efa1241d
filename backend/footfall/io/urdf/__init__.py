"""URDF files of robots that others described: reading them, and the robot.toml proposed beside them."""
