"""Stances, steps and walks of any robot: which planners are asked follows from its class, here and nowhere else."""

from functools import singledispatch

from footfall.planning.legged.stand import stand as stand_legged
from footfall.planning.legged.step import plan_step as plan_legged_step
from footfall.planning.legged.walk import plan_walk as plan_legged_walk
from footfall.planning.step.plan import plan_step as plan_rover_step
from footfall.planning.walk.plan import plan_walk as plan_rover_walk
from footfall.planning.walk.stand import stand as stand_rover
from footfall.robot.legged.legged_robot import LeggedRobot

stand = singledispatch(stand_rover)
stand.register(LeggedRobot, stand_legged)

plan_step = singledispatch(plan_rover_step)
plan_step.register(LeggedRobot, plan_legged_step)

plan_walk = singledispatch(plan_rover_walk)
plan_walk.register(LeggedRobot, plan_legged_walk)
