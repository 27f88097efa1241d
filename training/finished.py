"""What is finished stays: a file of JSON lines that a run adds to, and that goes on where it was interrupted."""

import json
import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from footfall.core.errors import InvalidInput

Item = dict[str, Any]


class Finished:
    """Items by key. The first line says what they are of: a file of anything else is refused with InvalidInput.

    A last line that was cut off while it was written is dropped, and made again.
    """

    def __init__(self, path: Path, what: Item) -> None:
        self._path = path
        head = json.dumps(what, sort_keys=True)
        self._items: dict[str, Item] = {}
        whole = self._whole_lines()
        if whole and whole[0] != head:
            raise InvalidInput(
                f"{path.name} is of {whole[0][:300]}, this run of {head}; go on with the same arguments, or choose "
                "another file"
            )
        for number, line in enumerate(whole[1:], 2):
            try:
                item = json.loads(line)
                self._items[item["key"]] = item["item"]
            except (ValueError, KeyError, TypeError) as err:
                raise InvalidInput(
                    f"{path.name} can't be read, its line {number} is damaged; remove that line"
                ) from err
        if not whole:
            self._add(head)

    def __contains__(self, key: str) -> bool:
        return key in self._items

    def __getitem__(self, key: str) -> Item:
        return self._items[key]

    def put(self, key: str, item: Item) -> None:
        """Add an item, on the disk when this returns."""
        self._add(json.dumps({"key": key, "item": item}))
        self._items[key] = item

    def _whole_lines(self) -> list[str]:
        if not self._path.exists():
            return []
        content = self._path.read_bytes()
        whole = content[: content.rfind(b"\n") + 1]
        if len(whole) < len(content):
            with self._path.open("r+b") as file:
                file.truncate(len(whole))
        return whole.decode().splitlines()

    def _add(self, line: str) -> None:
        with self._path.open("a") as file:
            file.write(line + "\n")
            file.flush()
            os.fsync(file.fileno())


def completed(
    finished: Finished,
    tasks: Sequence[tuple[str, Any]],
    make: Callable[[tuple[str, Any]], tuple[str, Item]],
    told: Callable[[str], None],
    processes: int = 1,
    scheduler: str | None = None,
) -> Iterator[Item]:
    """The item of every task (key, arguments), in their order, whatever the order in which they were finished.

    make: of one task; told: hears of each that is finished. processes, scheduler: who makes them, as for
    ``made_by_many``; one process is this one.
    """
    left = [task for task in tasks if task[0] not in finished]
    for number, (key, item) in enumerate(_made(left, make, processes, scheduler), len(tasks) - len(left) + 1):
        finished.put(key, item)
        told(f"{number} of {len(tasks)}: {key}")
    return (finished[key] for key, _ in tasks)


def _made(
    tasks: Sequence[tuple[str, Any]],
    make: Callable[[tuple[str, Any]], tuple[str, Item]],
    processes: int,
    scheduler: str | None,
) -> Iterator[tuple[str, Item]]:
    """As they come."""
    if not tasks or (processes == 1 and scheduler is None):
        yield from map(make, tasks)
        return
    # one process needs no cluster, nor the library for it
    from training.cluster import made_by_many

    yield from made_by_many(tasks, make, processes, scheduler)
