// What is drawn over an image, from the lines that the server projected into it. Each line is drawn twice, dark below light,
// so that it shows on any ground.

const SPACE = "http://www.w3.org/2000/svg";

const shape = (tag, attributes) => {
  const made = document.createElementNS(SPACE, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  return made;
};

const way = (line) => line.map(([u, v], i) => `${i ? "L" : "M"}${u} ${v}`).join("");
const dots = (points) => points.map(([u, v]) => `M${u} ${v}h0`).join("");

function drawn(kind, d) {
  return d ? ["below", "above"].map((layer) => shape("path", { class: `${layer} ${kind}`, d })) : [];
}

const CROSS = 14; // px of the image

export const cross = ([u, v]) => drawn("cross", `M${u - CROSS} ${v}h${2 * CROSS}M${u} ${v - CROSS}v${2 * CROSS}`);

// accepted: of the footfall, true, false, or null while nothing was decided. show: {plan, grid}.
export function lines(overlay, accepted, show) {
  const made = [];
  if (show.grid) made.push(...drawn("grid", overlay.grid.map(way).join("")));
  if (show.plan) {
    for (const phase of ["lift", "swing", "lower"]) {
      made.push(...drawn(`way ${phase}`, overlay.path.filter((one) => one.phase === phase).map(({ line }) => way(line)).join("")));
    }
    made.push(...drawn("waypoint", dots(overlay.waypoints)), ...drawn("through", dots(overlay.through)));
    made.push(...footfall(overlay.footfall, accepted));
  }
  return made;
}

function footfall(chosen, accepted) {
  if (!chosen) return [];
  const kind = `footfall ${accepted === null ? "open" : accepted ? "yes" : "no"}`;
  const made = drawn(kind, [...chosen.ring, ...chosen.normal].map(way).join(""));
  if (accepted === false && chosen.seen === "in sight") {
    const [u, v] = chosen.at;
    made.push(...drawn(kind, `M${u - 8} ${v - 8}l16 16M${u + 8} ${v - 8}l-16 16`));
  }
  return made;
}
