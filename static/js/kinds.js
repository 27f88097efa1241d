// Where the page shows each kind of product, one row a kind of backend/footfall/session/products/kinds.py.
// area: where the page shows it; sign: on the timeline, a key of its SIGNS; shown: below the session, where the timeline
// reads what it was; as: the kind that panels know it as. What a kind is called stands in texts/kinds.js; one that is not named there goes by its own name.

export const KINDS = {
  terrain: { area: "ground", sign: "terrain" },
  photographs: { area: "ground", sign: "terrain" },
  blend: { area: "ground", sign: "terrain" },
  clear: { area: "ground", sign: "terrain" },
  maps: { area: "ground", sign: "maps" },
  plan: { area: "plan", sign: "plan", shown: "plans" },
  after: {},
  what_if: {},
  execution: { area: "execution", sign: "execution", shown: "executions" },
  shift: { sign: "plan" },
  body_move: { sign: "plan" },
  held_move: { sign: "execution" },
  queue: { area: "plan", sign: "plan" },
  held_queue: { sign: "execution" },
  walk: { area: "walk", sign: "plan" },
  gait: { area: "walk", sign: "plan" },
  route: { area: "goal", sign: "plan" },
  described_maps: { area: "ground", sign: "maps" },
  described_step: { area: "plan", sign: "plan", as: "plan" },
  described_walk: { area: "walk", sign: "plan", as: "walk" },
  sequence: { area: "commands", sign: "sequence" },
  foot_moves: { area: "commands", sign: "sequence" },
  outcome: {},
  edit: { area: "commands", sign: "sequence" },
  import: { area: "commands", sign: "sequence" },
  export: { sign: "export" },
};
