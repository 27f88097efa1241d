"""The robot's shapes as meshes: made, drawn, and asked with coal what they touch."""
