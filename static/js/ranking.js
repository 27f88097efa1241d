// Which acts a few typed letters mean, best first. Nothing of the page is needed.

// How well the letters fit a name, in their order; lower is better, null where they don't.
function fit(typed, text) {
  let at = -1;
  let score = 0;
  for (const letter of typed.replaceAll(" ", "")) {
    const next = text.indexOf(letter, at + 1);
    if (next < 0) return null;
    const begins = next === 0 || text[next - 1] === " ";
    score += begins ? 0 : next - at - 1;
    at = next;
  }
  return score + text.length / 1000;
}

// 0: the name begins so; 1: each typed word begins a word of it; 2: the letters are there, in their order.
function nearness(typed, text) {
  const words = typed.split(" ").filter(Boolean);
  if (text.startsWith(words.join(" "))) return 0;
  return words.every((word) => ` ${text}`.includes(` ${word}`)) ? 1 : 2;
}

// acts: [{text, against, uses}] with what stands against each now, "" where nothing does, and how often it was chosen.
// The answer: those that the letters fit. Of names that fit alike what can be done comes first, then what was chosen more often.
export function ranked(typed, acts) {
  const meant = typed.toLowerCase().trim();
  const scored = acts.flatMap((one) => {
    const text = one.text.toLowerCase();
    const score = fit(meant, text);
    if (score === null) return [];
    const near = nearness(meant, text);
    return [[[near, one.against ? 1 : 0, near === 2 ? score : 0, -one.uses, score], one]];
  });
  return scored.sort(([a], [b]) => a.map((part, i) => part - b[i]).find(Boolean) ?? 0).map(([, one]) => one);
}
