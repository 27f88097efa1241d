"""Learns which way of walking goes on from here, and shows what it is worth. Nothing of FootFall imports it.

``python -m training.gait_policy`` learns, ``python -m training.evaluate`` compares on ground that is new.
"""
