"""The rover in physics (MuJoCo): joints and wheels that give way, contact, friction; and a referee over sequences."""
