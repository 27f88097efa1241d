"""Who asks and what they may: the identity of each request, and the role that each route needs."""
