"""Which gait, or a planned walk, goes on from here: learned as a Markov decision process.

Above ``planning/gait`` and ``planning/walk``, which it uses as they are. Source: P. Mihelich, "Motion planning for the
ATHLETE rover with reinforcement learning".
"""
