"""Where to look from: what the cameras of a rover would show, and from where they would show what is not known."""
