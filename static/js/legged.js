// Steps and walks of a robot that others described, as the panels read those of ATHLETE's legs. What such answers lack stays away.

export const asPanelsRead = (answer) => ({
  ...answer, plan: byFootMoves(answer.plan), partial: byFootMoves(answer.partial), decisions: [], instead: null,
  blocked: answer.refused.map(([check_name, count]) => ({ check_name, count, leg: null, x: null })),
});

// moves: of each waypoint which foot move it is part of, from 0; after the last it is the chassis' way. legs: of each foot move.
function byFootMoves(plan) {
  if (!plan) return null;
  let number = 0;
  const moves = plan.phases.map((phase, i) => (phase === "lower" && plan.phases[i + 1] !== "lower" ? number++ : number));
  return { ...plan, moves, legs: plan.moves };
}
