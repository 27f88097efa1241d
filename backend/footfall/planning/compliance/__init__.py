"""How the rover gives way: joints and wheels are springs, so what is commanded is not what happens."""
