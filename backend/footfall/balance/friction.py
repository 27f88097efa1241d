"""How much friction is counted on where nobody says otherwise: by plans, rules and simulated rovers alike."""

FRICTION = 0.6
"""Coefficient between wheel and ground."""
