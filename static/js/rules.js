// Rules of a command sequence in words. Nothing is done or shown here.

// A rule of the whole sequence says row −1.
export const ruleTold = ({ row, text }) => (row < 0 ? text : `row ${row + 1}: ${text}`);
