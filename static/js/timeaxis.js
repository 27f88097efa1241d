// A whole session on one line: times to places 0…1 and back. Long pauses are cut
// short, and what came at once is drawn apart: times are in their order, not to scale.

const LONGEST = 20; // s, to which a pause is cut
const LEAST = 3; // s, as which no time at all is drawn
const QUICK = 0.1; // s, the same of events that come by the dozen

// times: of the events, in their order, the last one being the end of the line. quick: whether each is one of many alike.
export function timeAxis(times, quick) {
  const at = [0];
  for (let i = 1; i < times.length; i += 1) at.push(at[i - 1] + Math.min(Math.max(times[i] - times[i - 1], quick[i] ? QUICK : LEAST), LONGEST));
  const whole = at.at(-1) || 1;
  const between = (knots, others, wanted) => {
    let [low, high] = [0, knots.length - 1];
    if (high < 1 || wanted <= knots[0]) return others[0];
    if (wanted >= knots[high]) return others[high];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (knots[middle] <= wanted) low = middle;
      else high = middle;
    }
    const span = knots[high] - knots[low];
    return others[low] + (span > 0 ? (wanted - knots[low]) / span : 0) * (others[high] - others[low]);
  };
  return {
    placeOf: (time) => between(times, at, time) / whole,
    timeAt: (place) => between(at, times, place * whole),
    placeOfKnot: (i) => at[i] / whole,
    pauses: times.flatMap((time, i) => (i > 0 && time - times[i - 1] > 3 * LONGEST ? [(at[i] + at[i - 1]) / 2 / whole] : [])),
  };
}
