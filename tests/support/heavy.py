"""Files that ``make quick`` leaves out of the pure layers: each computes for several seconds, or with processes.

They are marked ``heavy``. A law of each layer stays in: take a file off this list where it became quick.
"""

from pathlib import Path

HEAVY = {
    "maps/test_reach.py",
    "maps/test_traversability_tiles.py",
    "planning/test_ambler_walk.py",
    "planning/test_benchmark_figures.py",
    "planning/test_body_move.py",
    "planning/test_choice_iteration.py",
    "planning/test_circulating.py",
    "planning/test_coarse_ground.py",
    "planning/test_compliance.py",
    "planning/test_execution.py",
    "planning/test_execution_in_physics.py",
    "planning/test_execution_predicted_pose.py",
    "planning/test_find_shift.py",
    "planning/test_heuristics.py",
    "planning/test_leg_maps.py",
    "planning/test_legged_maps.py",
    "planning/test_legged_walk.py",
    "planning/test_nearest_place.py",
    "planning/test_problem_set.py",
    "planning/test_rappel.py",
    "planning/test_recheck_walk.py",
    "planning/test_seen_clearance.py",
    "planning/test_stance_reserve.py",
    "planning/test_step_choices.py",
    "planning/test_step_fast.py",
    "planning/test_step_ompl.py",
    "planning/test_step_plan.py",
    "planning/test_step_race.py",
    "planning/test_step_searches.py",
    "planning/test_unsolvable.py",
    "planning/test_walk_plan.py",
    "planning/test_way_on.py",
    "planning/test_whole_body.py",
    "robot/test_clearance.py",
    "robot/test_clearance_ground.py",
    "robot/test_clearance_motion.py",
    "robot/test_leg_overlap.py",
    "robot/test_legged_model.py",
    "robot/test_legged_tree.py",
    "robot/test_robot_collision.py",
    "sequence/test_posture_move.py",
    "sequence/test_yielding.py",
    "sequence/test_yielding_in_physics.py",
    "terrain/test_dem_files.py",
}
"""Of the folder ``tests``."""


def is_heavy(path: Path) -> bool:
    return "/".join(path.parts[-2:]) in HEAVY
