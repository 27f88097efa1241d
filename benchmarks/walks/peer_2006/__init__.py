"""The planner of Hauser, Bretl, Latombe & Wilcox, "Motion planning for a six-legged lunar robot" (2006), as a peer."""
