// Where a floating area may be: a box {left, top, width, height} and the room for it, in pixels. No part of the page is needed.

const LEAST = { width: 260, height: 120 };

const within = (value, least, most) => Math.max(least, Math.min(value, most));

// The box, no larger than the room and inside of it; as large as it can be used, where the room is.
export function fitted(box, room) {
  const width = within(box.width, Math.min(LEAST.width, room.width), room.width);
  const height = within(box.height, Math.min(LEAST.height, room.height), room.height);
  return {
    left: within(box.left, room.left, room.left + room.width - width),
    top: within(box.top, room.top, room.top + room.height - height),
    width,
    height,
  };
}

export const moved = (box, [right, down]) => ({ ...box, left: box.left + right, top: box.top + down });
export const stretched = (box, [right, down]) => ({ ...box, width: box.width + right, height: box.height + down });
