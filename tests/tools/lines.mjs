// Runs the page's lines of stops and of events as they are shipped, with WebSockets that open and close when told to.
// Out: {stops, events, full}: after how many ms each opens the next one when its own has closed, and to which address.

import { pathToFileURL } from "node:url";

const js = (name) => import(pathToFileURL(`${process.argv[3]}/js/${name}`).href);
const sockets = [];
const waits = [];

class Line extends EventTarget {
  static OPEN = 1;
  readyState = 1;
  constructor(address) {
    super();
    this.address = address;
    sockets.push(this);
  }
  close(code) { this.dispatchEvent(Object.assign(new Event("close"), { code, reason: "" })); }
}

const element = () => new Proxy({ dataset: {}, classList: { add() {}, remove() {}, toggle() {} }, style: {} }, {
  get: (own, name) => own[name] ?? (() => undefined),
});
const nothing = { digest: null };
const summary = { id: "s", events: 5, jobs: [], plan: nothing, walk: null, gait: null, route: null, sequence: null };
Object.assign(globalThis, {
  WebSocket: Line,
  location: { origin: "http://127.0.0.1:1" },
  sessionStorage: { getItem: () => "page", setItem() {} },
  document: { getElementById: element, createElement: element, addEventListener() {}, querySelector: element, querySelectorAll: () => [] },
  setTimeout: (act, after) => { waits.push({ act, after }); return waits.length; },
  setInterval: () => 0,
  fetch: async () => new Response(JSON.stringify(summary), { headers: { "content-type": "application/json" } }),
});

// The one line that was opened last, closed with a code: what happens next.
function closed(code) {
  waits.length = 0;
  const before = sockets.length;
  sockets.at(-1).close(code);
  const opens = waits.filter(({ act }) => {
    const had = sockets.length;
    act();
    return sockets.length > had;
  });
  return { after: opens.map(({ after }) => after), opened: sockets.slice(before).map(({ address }) => address) };
}

const { keepLineOpen } = await js("stopline.js");
keepLineOpen();
sockets.at(-1).dispatchEvent(new Event("open"));
const stops = [closed(1006), closed(1009)]; // once more: it is kept open, not opened again once
const { known } = await js("store.js");
known.robot = { athletes_build: true }; // the page knows it before it follows
const { follow } = await js("stream.js");
await follow();
const events = closed(1006);
const full = closed(1013);
console.log(JSON.stringify({ stops, events, full }));
