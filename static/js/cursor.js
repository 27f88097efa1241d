// One moment that timeline, plots and ghost share [s since 1970]; null is now.

const followers = [];
let at = null;

export const moment = () => at;

export function point(time) {
  at = time;
  for (const follower of followers) follower(at);
}

export function followCursor(follower) {
  followers.push(follower);
}
