"""A session whose odometry has drifted: two looks behind its map, of which the second moved the rover."""

from dataclasses import replace

from footfall.core.frames import inverse
from footfall.session.products.kinds import TERRAIN
from footfall.terrain.terrain_settings import TerrainSettings


def looked_twice(live, dem, standing, correction):
    """Map and log of a session as after two looks from the same place, the second moved onto the map by ``correction``.

    Returns the map, and the rover as its odometry has it where it really stands as ``standing`` says.
    """
    told = replace(standing, T_site_base=inverse(correction) @ standing.T_site_base)
    moved = replace(dem, correction=correction, provenance=replace(dem.provenance, settings=TerrainSettings()))
    below = None
    for snapshot, made, state in (("a" * 32, dem, standing), ("b" * 32, moved, told)):
        live.folded_log.record("snapshot_taken", {"digest": snapshot, "state": live.put(state), "pairs": []})
        parents = {"robot": live.robot_digest, "snapshot": snapshot, **({} if below is None else {"map": below})}
        below = live.put(made)
        live.folded_log.record("product", {"kind": TERRAIN.name, "parents": parents, "settings": None, "digest": below})
    return moved, told
