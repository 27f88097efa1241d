"""What a link of a leg can hit, as codes of eight bits; LEG + i is leg i."""

NOTHING, CHASSIS, PAYLOAD, SELF, TERRAIN, LEG = 0, 1, 2, 3, 4, 8
