// What a robot that others described does not have, in one short line each.

const ATHLETES = "For ATHLETE's legs alone";

export const ALONE = {
  cameras: "This robot has no cameras: load the ground as a file.",
  ground: `${ATHLETES}: load the ground as another file.`,
  judged: `${ATHLETES}: this robot is judged with settings as delivered.`,
  suggestions: `${ATHLETES}: nothing is suggested for this robot.`,
  chassis: `${ATHLETES}: moves of this robot's chassis are part of its steps and walks.`,
  settings: `${ATHLETES}: this robot's steps and walks are planned with settings as delivered.`,
  lead: `${ATHLETES}: no points lead this robot's foot.`,
  alternatives: `${ATHLETES}: there is one plan of this robot's step.`,
  ways: `${ATHLETES}: this robot goes in no gait, and hangs on no tether.`,
  places: `${ATHLETES}: walks of this robot keep off no ground that is marked.`,
  parts: "Commands of the whole walk are made under Commands.",
  loop: `${ATHLETES}: this robot does not walk by itself.`,
  sag: `${ATHLETES}: commands hold the pose of this robot where its description says how stiff every joint is.`,
  margins: `${ATHLETES}: the checks of a plan tell this robot's least margin.`,
  clearances: `${ATHLETES}: the clearance of this robot's feet is not measured.`,
  page: `${ATHLETES}: the page that plays a session alone does not draw this robot.`,
};
