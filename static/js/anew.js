// Loads the page anew. Several parts of it may find out at the same time that another session is shown from now on: a reload
// that is asked for while one is under way would begin it again.

const PATIENCE = 10_000; // ms: one that was cut off, as Escape does, is asked for again

let askedAt = -Infinity;

export function loadAnew() {
  if (performance.now() - askedAt < PATIENCE) return;
  askedAt = performance.now();
  location.reload();
}
