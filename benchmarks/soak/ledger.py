"""What a client was told, kept apart from the server, and compared with what the server and the rover have kept."""

import threading
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from footfall.session.storage.store import read_session
from footfall.session.storage.verify import verify


@dataclass
class Ledger:
    """Of one session.

    heard: hash of every event that a listener got, by number. notes: texts whose POST was answered; asked: all texts.
    runs: ids of the commands of each run whose sending was answered. products: digests of finished jobs.
    stopped: a stop was answered, and clearing it was not asked for yet.
    """

    heard: dict[int, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)
    runs: dict[int, list[str]] = field(default_factory=dict)
    products: list[str] = field(default_factory=list)
    stopped: bool = False
    contradictions: list[str] = field(default_factory=list)
    guard: threading.Lock = field(default_factory=threading.Lock)

    def hear(self, event: dict[str, Any]) -> None:
        """An event came to a listener. The same number with another hash is a contradiction."""
        with self.guard:
            known = self.heard.setdefault(event["seq"], event["hash"])
            if known != event["hash"]:
                self.contradictions.append(f"event {event['seq']} was told with two contents")

    @property
    def acknowledged(self) -> int:
        """How many things were acknowledged: events heard, notes, runs, products."""
        return len(self.heard) + len(self.notes) + len(self.runs) + len(self.products)


@dataclass(frozen=True)
class Verdict:
    """What is not as it was acknowledged, in words; commands: how many were sent, and carried out."""

    lost: tuple[str, ...]
    doubled: tuple[str, ...]
    damage: tuple[str, ...]
    events: int
    sent: int
    executed: int

    @property
    def ok(self) -> bool:
        """Whether nothing is lost, doubled or damaged."""
        return not (self.lost or self.doubled or self.damage)


def compare(ledger: Ledger, data: Path, session: str, executed: list[str]) -> Verdict:
    """The ledger beside the log on the disk, and the rover's journal (``executed``) beside both.

    The session may go on meanwhile: what was heard is taken before the log is read, which has it then.
    """
    with ledger.guard:
        heard, contradictions = dict(ledger.heard), list(ledger.contradictions)
    records = read_session(data / session).records
    by_number = {record["seq"]: record["hash"] for record in records}
    of = {kind: [r["payload"] for r in records if r["type"] == kind] for kind in {r["type"] for r in records}}
    notes = Counter(payload["text"] for payload in of.get("note", ()))
    runs = {payload["run"] for payload in of.get("run_started", ())}
    sent = Counter(payload["id"] for payload in of.get("command_sent", ()))
    done = {payload["id"] for payload in of.get("command_done", ())}
    made = {payload["digest"] for payload in of.get("product", ())}
    carried_out = Counter(executed)
    lost = [f"event {seq} was heard and is not in the log" for seq in heard if by_number.get(seq) != heard[seq]]
    lost += [f"the note {text!r} was answered and is not in the log" for text in ledger.notes if not notes[text]]
    lost += [f"run {run} was answered and is not in the log" for run in ledger.runs if run not in runs]
    lost += [f"product {digest} was finished and is not in the log" for digest in ledger.products if digest not in made]
    lost += [f"command {one} is done by the log, and the rover never began it" for one in done - carried_out.keys()]
    lost += [f"command {one} was carried out and is not in the log" for one in carried_out.keys() - sent.keys()]
    doubled = [f"the note {text!r} is in the log {notes[text]} times" for text in ledger.asked if notes[text] > 1]
    doubled += [f"command {one} was sent {count} times" for one, count in sent.items() if count > 1]
    doubled += [f"command {one} was carried out {count} times" for one, count in carried_out.items() if count > 1]
    doubled += contradictions
    damage = [f"{one.kind}: {one.text}" for one in verify(data, [session]) if one.harmful]
    return Verdict(tuple(lost), tuple(doubled), tuple(damage), len(records), len(sent), len(carried_out))
