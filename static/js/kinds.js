// What the page calls each kind of product, one row a kind of backend/footfall/session/products/kinds.py.
// made: what who made it did, from the payload of its event; title: its job, where its name is no word of the field;
// area: where the page shows it; sign: on the timeline, a key of its SIGNS; shown: below the session, where the timeline
// reads what it was. A kind without a row goes by its name.

const STATUSES = { no_path: "no way was found", time_limit: "the time limit has passed", off_map: "off the map", unknown_ground: "unknown ground" };

// How planning ended; who: what was to go to the goal.
export function statusTold(status, who = "the leg") {
  if (status === "start_invalid") return `${who} cannot start from here`;
  return status === "goal_invalid" ? `${who} cannot stand there` : STATUSES[status] ?? inWords(status);
}

const inWords = (status) => status.replaceAll("_", " ");

export const KINDS = {
  terrain: { area: "ground", sign: "terrain", made: () => "built the terrain" },
  photographs: { area: "ground", sign: "terrain", made: () => "built the terrain" },
  blend: { area: "ground", sign: "terrain", made: () => "blended terrains" },
  clear: { area: "ground", sign: "terrain", made: () => "cleared ground" },
  maps: { title: "colours", area: "ground", sign: "maps", made: ({ leg }) => `coloured the ground for leg ${leg}` },
  plan: { area: "plan", sign: "plan", shown: "plans", made: ({ leg, status }) => `planned the step of leg ${leg}: ${statusTold(status)}` },
  after: { title: "predicted stance", made: () => "goes on from the end of a plan" },
  what_if: { title: "what-if", made: () => "shifted the chassis in a what-if" },
  execution: { title: "prediction of sag", area: "execution", sign: "execution", shown: "executions", made: ({ status }) => `predicted the sag: ${inWords(status)}` },
  shift: { title: "shift of the chassis", sign: "plan", made: () => "looked for a shift of the chassis" },
  body_move: { title: "move of the chassis", sign: "plan", made: () => "checked a move of the chassis" },
  held_move: { title: "chassis move with the pose held", sign: "execution", made: () => "predicted the sag of a move of the chassis" },
  walk: { area: "plan", sign: "plan", made: ({ status }) => `planned a walk: ${statusTold(status, "the rover")}` },
  gait: { area: "plan", sign: "plan", made: ({ status }) => `planned a gait: ${statusTold(status, "the rover")}` },
  route: { area: "plan", sign: "plan", made: ({ status }) => `planned a route: ${statusTold(status, "the rover")}` },
  sequence: { title: "commands", area: "commands", sign: "sequence", made: () => "made commands" },
  foot_moves: { title: "commands of foot moves", area: "commands", sign: "sequence", made: () => "made commands of a walk" },
  outcome: { made: () => "compared the run with its prediction" },
  edit: { area: "commands", sign: "sequence", made: () => "edited the commands" },
  import: { area: "commands", sign: "sequence", made: () => "read commands from a file" },
  export: { sign: "export", made: ({ format }) => `exported the commands as ${format}` },
};

export const titleOf = (kind) => KINDS[kind]?.title ?? kind.replaceAll("_", " ");

// At the beginning of a sentence.
export const namedFirst = (kind) => titleOf(kind).replace(/^./, (letter) => letter.toUpperCase());

export const madeOf = (payload) => KINDS[payload.kind]?.made(payload) ?? `made: ${payload.kind.replaceAll("_", " ")}`;
