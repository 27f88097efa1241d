// Numbers of a plot: what the recordings have, and behind it what this page heard itself. Pure.

const SILENT_AFTER = 2; // s; a pause that is longer is a silence

/**
 * Both as one, oldest first, with nothing (null) in each silence: no line leads over what was not heard.
 * @param {any[][]} recorded times and numbers, as the server told them
 * @param {number[][]} silences of the recordings
 * @param {any[][]} own times and numbers that this page heard
 * @param {number} begin
 * @param {number} end
 */
export function joined(recorded, silences, own, begin, end) {
  const last = recorded[0].at(-1) ?? -Infinity;
  const from = own[0].findIndex((time) => time > last + SAME && time >= begin);
  const until = own[0].findLastIndex((time) => time <= end) + 1;
  const tail = from < 0 || until <= from ? own.map(() => []) : own.map((column) => column.slice(from, until));
  const data = recorded.map((column, j) => [...column, ...tail[j].map((one) => (Number.isNaN(one) ? null : one))]);
  const heard = [...(last > -Infinity ? [last] : []), ...tail[0]];
  const pauses = [...silences, ...heard.slice(1).map((time, i) => [heard[i], time]).filter(([a, b]) => b - a > SILENT_AFTER)];
  return { data: withGaps(data, pauses), pauses };
}

// s: a frame that the recording has is not told twice, though its way to this page took a while. What so is left out at first is
// there as soon as the recording is asked again.
const SAME = 1;

const AT = 0.01; // s

function withGaps(data, pauses) {
  const breaks = pauses.map(([from]) => data[0].findLastIndex((time) => time <= from + AT)).filter((i) => i >= 0 && i + 1 < data[0].length);
  if (!breaks.length) return data;
  return data.map((column, j) => {
    const pieces = [];
    let at = 0;
    for (const i of [...new Set(breaks)].sort((a, b) => a - b)) {
      pieces.push(...column.slice(at, i + 1), j === 0 ? (data[0][i] + data[0][i + 1]) / 2 : null);
      at = i + 1;
    }
    return [...pieces, ...column.slice(at)];
  });
}

/** The index of the moment that is nearest to a time, -1 where there is none. */
export function nearest(times, time) {
  let [low, high] = [0, times.length - 1];
  if (high < 0) return -1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] <= time) low = middle;
    else high = middle;
  }
  return Math.abs(times[high] - time) < Math.abs(times[low] - time) ? high : low;
}
