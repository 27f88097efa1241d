"""The command gate: the lease of the one commander, what is checked, and what may go to the rover when. No I/O."""
