// What all plots paint alike.

import { ink } from "../themes.js";

// From where to where an axis goes. The channels' limits are in sight where the numbers come near them; far ones would make
// flat lines of all.
export function range(channels, low, high) {
  if (low === null || high === null) return [-1, 1];
  const bounds = channels.flatMap((one) => [one.low, one.high]).filter((limit) => limit !== null);
  const reach = Math.max(Math.abs(low), Math.abs(high)) * 2;
  const near = bounds.filter((limit) => Math.abs(limit) <= reach);
  const [least, most] = [Math.min(low, ...near), Math.max(high, ...near)];
  const margin = Math.max((most - least) * 0.08, 1e-3 * Math.max(1, reach));
  return [least - margin, most + margin];
}

// Paints on the plot's own place, and nowhere beside it.
export function inside(made, paint) {
  const { left, top, width, height } = made.bbox;
  made.ctx.save();
  made.ctx.beginPath();
  made.ctx.rect(left, top, width, height);
  made.ctx.clip();
  paint(made.ctx, made.bbox);
  made.ctx.restore();
}

// The moment that is read; null where there is none.
export function paintMoment(made, time) {
  if (time === null) return;
  inside(made, (pen, { top, height }) => {
    const x = made.valToPos(time, "x", true);
    pen.strokeStyle = ink("strong");
    pen.lineWidth = 2;
    pen.beginPath();
    pen.moveTo(x, top);
    pen.lineTo(x, top + height);
    pen.stroke();
  });
}
