"""Bundles and artifacts as files: the same bytes for the same content, and nothing hostile gets in."""

import ast
import contextlib
import io
import json
import stat
import tracemalloc
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import footfall
from footfall.core.errors import InvalidBundle
from footfall.core.grid import GridGeometry
from footfall.core.value import Provenance, digest_flat, flatten
from footfall.io import artifacts, bundles
from footfall.io.artifacts import HOMES, decode, encode
from footfall.io.bundles import migrate, read_bundle
from footfall.io.event_log import rechain
from footfall.io.exports import SUFFIXES
from footfall.maps.layers import MapSettings, MapStack
from footfall.session.storage.verify import verify
from footfall.terrain.dem import Dem


@given(hnp.arrays(np.float32, hnp.array_shapes(max_dims=3, max_side=4)), st.text(max_size=8))
def test_values_come_back_bit_for_bit(array, name):
    value = Provenance({"array": name}, None, 3)
    assert decode(encode(value)).digest == value.digest
    shape = (2, 3)
    layer = np.resize(array, shape)
    stack = MapStack(GridGeometry(0.0, 0.0, 1.0, *shape), 0, "plain", {"slope": layer}, value)
    data = encode(stack)
    again = decode(data, expect=stack.digest)
    assert isinstance(again, MapStack)
    assert again.layers["slope"].tobytes() == layer.tobytes()
    assert encode(again) == data


@given(st.data())
def test_damaged_artifacts_are_refused_and_never_believed(data):
    value = MapSettings()
    whole = encode(value)
    i = data.draw(st.integers(0, len(whole) - 1))
    damaged = bytearray(whole)
    damaged[i] ^= data.draw(st.integers(1, 255))
    with contextlib.suppress(InvalidBundle):
        again = decode(bytes(damaged), expect=value.digest, name="a.npz")
        assert flatten(again)[0] == flatten(value)[0]  # a zip holds bytes that mean nothing
    with pytest.raises(InvalidBundle):
        decode(whole[:i])


def test_pickles_and_false_headers_are_refused():
    def packed(**arrays):
        out = io.BytesIO()
        np.savez(out, allow_pickle=True, **arrays)
        return out.getvalue()

    for data in (
        packed(structure=np.array([{}], object)),
        packed(something=np.zeros(3)),
        packed(structure=np.frombuffer(b"[1]", np.uint8)),
        packed(structure=np.frombuffer(b'{"value":"os","of":{}}', np.uint8)),
        b"no zip",
    ):
        with pytest.raises(InvalidBundle, match="artifact"):
            decode(data)


def test_too_large_an_artifact_is_refused(monkeypatch):
    monkeypatch.setattr(artifacts, "MAX_BYTES", 100)
    with pytest.raises(InvalidBundle, match="larger than"):
        decode(encode(MapSettings()))


def test_to_read_a_large_artifact_takes_little_more_memory_than_it_has():
    heights = np.full((2000, 2000), np.nan, np.float32)
    heights[0, 0] = 1.0
    large = Dem(heights, GridGeometry(0.0, 0.0, 0.02, 2000, 2000), "large", Provenance({}))
    packed = encode(large)
    tracemalloc.start()
    try:
        read = decode(packed, expect=large.digest)
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert isinstance(read, Dem)
    assert np.array_equal(read.heights, heights, equal_nan=True)
    assert heights.nbytes <= most < 1.4 * heights.nbytes


def test_an_entry_that_is_shorter_than_it_says_is_refused():
    packed = bytearray(encode(MapSettings()))
    length = packed.rindex(b"PK\x01\x02") + 24  # of the last entry, unpacked, in the list at the end
    packed[length] += 1
    with pytest.raises(InvalidBundle, match=r"shorter|damaged or cut"):
        decode(bytes(packed))


def test_a_value_that_gained_a_field_keeps_its_old_name():
    structure, arrays = flatten(MapSettings())
    del structure["of"]["stable_margin"]
    text = np.frombuffer(json.dumps(structure).encode(), np.uint8)
    out = io.BytesIO()
    np.savez(out, structure=text)
    old = digest_flat(structure, arrays)
    value = decode(out.getvalue(), expect=old)
    assert value.digest == old != MapSettings().digest
    assert isinstance(value, MapSettings)
    assert value.stable_margin == 0.0


def test_every_value_has_a_home():
    package = Path(footfall.__file__).parent
    found = set()
    for path in package.rglob("*.py"):
        module = ".".join(path.relative_to(package.parent).with_suffix("").parts)
        if module.startswith(("footfall.session", "footfall.api", "footfall.sim")):
            continue
        for item in ast.walk(ast.parse(path.read_text())):
            if isinstance(item, ast.ClassDef) and any(
                isinstance(d, ast.Name) and d.id in ("value", "value_enum") for d in item.decorator_list
            ):
                found.add((module, item.name))
    listed = {(module, name) for module, names in HOMES.items() for name in names}
    assert found == listed, "footfall.io.artifacts.HOMES must list exactly the values below the session"


def packed(files, links=()):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name, data in files:
            entry = zipfile.ZipInfo(name)
            if name in links:
                entry.external_attr = (stat.S_IFLNK | 0o777) << 16
            archive.writestr(entry, data)
    return out.getvalue()


def head(**about):
    return json.dumps({"format": "footfall-session", "version": 1, **about})


GOOD = [("session.json", head()), ("events.jsonl", "")]


@pytest.mark.parametrize("name", ["../evil", "/etc/evil", "artifacts/../../evil", "a\\b", "c:evil", "evil.py"])
def test_names_that_leave_the_bundle_are_refused(name):
    with pytest.raises(InvalidBundle, match=r"evil|a.*b"):
        read_bundle(packed([*GOOD, (name, b"x")]))


def test_links_duplicates_and_oversize_are_refused(monkeypatch, tmp_path):
    name = f"artifacts/{'0' * 32}.npz"
    with pytest.raises(InvalidBundle, match="link"):
        read_bundle(packed([*GOOD, (name, b"/etc/passwd")], links=[name]))
    with pytest.warns(UserWarning, match="Duplicate"):
        twice = packed([*GOOD, (name, b"a"), (name, b"b")])
    with pytest.raises(InvalidBundle, match="twice"):
        read_bundle(twice)
    (tmp_path / "session.json").write_text(head())
    (tmp_path / "events.jsonl").symlink_to("/etc/passwd")
    with pytest.raises(InvalidBundle, match="link"):
        read_bundle(tmp_path)
    monkeypatch.setattr(bundles, "MAX_ZIP_BYTES", 10)
    with pytest.raises(InvalidBundle, match="too large"):
        read_bundle(packed(GOOD))


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ([], "session.json"),
        (GOOD[:1], "events.jsonl"),
        ([("session.json", "{"), GOOD[1]], "no JSON"),
        ([("session.json", "{}"), GOOD[1]], "format"),
        ([("session.json", head(version=99)), GOOD[1]], "later version"),
        ([("session.json", head(version="1")), GOOD[1]], "version number"),
    ],
)
def test_what_is_no_session_is_refused(files, message):
    with pytest.raises(InvalidBundle, match=message):
        read_bundle(packed(files))
    with pytest.raises(InvalidBundle, match="no zip"):
        read_bundle(b"rubbish")


def test_migrations_lead_up_one_version_at_a_time():
    def renamed(session, records):
        session["title"] = session.pop("name")
        return session, [{**r, "type": "remark"} if r["type"] == "note" else r for r in records]

    def doubled(session, records):
        return session, [r for r in records for _ in range(2)]

    table = {1: renamed, 2: doubled}
    old = rechain([{"time": 1.0, "type": "note", "payload": {"text": "a"}}])
    session, records = migrate({"version": 1, "name": "n", "head": {}}, old, table, 3)
    assert session == {"version": 3, "title": "n"}
    assert [r["type"] for r in records] == ["remark", "remark"]
    assert records == rechain(records)
    assert old[0]["type"] == "note"
    with pytest.raises(InvalidBundle, match="no way"):
        migrate({"version": 1}, [], {2: doubled}, 3)
    assert migrate({"version": 3}, old, table, 3)[1] is old


def test_an_old_folder_is_brought_up_when_opened(sessions, session, monkeypatch):
    session.add_note("old")
    session_id, count = session.id, len(session.events())
    session.close()
    del sessions._open[session_id]
    monkeypatch.setattr(bundles, "VERSION", 2)
    monkeypatch.setattr(bundles.migrate, "__defaults__", ({1: lambda s, r: (s, r[:-1])}, 2))
    again = sessions.open(session_id)
    assert len(again.events()) == count  # one fewer, and the opening
    assert (sessions.folder / session_id / "events.v1.jsonl").is_file()
    exported = zipfile.ZipFile(io.BytesIO(again.export_bundle()))
    assert json.loads(exported.read("session.json"))["version"] == 2
    again.close()
    del sessions._open[session_id]
    assert sessions.open(session_id).events()[:count] == again.events()


def test_out_and_in_again(sessions, session):
    session.plans.step(2, (1.0, 0.0)).finish()
    session.sequences.make()
    exported = [session.sequences.export(format=format) for format in SUFFIXES if format != "html"]
    data = session.export_bundle()
    assert data == sessions.export_bundle(session.id)
    again = sessions.import_bundle(data)
    assert [again.get_bytes(one.digest) for one in again.state.exports] == exported
    assert verify(sessions.folder) == []
    assert again.id != session.id
    assert again.state.digest == session.state.digest
    assert sessions.current is again
    assert {one["id"] for one in sessions.list()} == {again.id, session.id}
    archive = zipfile.ZipFile(io.BytesIO(data))
    foldered = packed([(f"mine/{name}", archive.read(name)) for name in archive.namelist()])
    assert sessions.import_bundle(foldered).state.digest == session.state.digest


def test_a_damaged_import_leaves_nothing_behind(sessions, session):
    before = sorted(p.name for p in sessions.folder.iterdir())
    archive = zipfile.ZipFile(io.BytesIO(session.export_bundle()))
    files = [(n, archive.read(n)) for n in archive.namelist()]
    bad = [(n, encode(replace(MapSettings(), window=9.0)) if n.endswith(".npz") else d) for n, d in files]
    with pytest.raises(InvalidBundle, match=r"\.npz is damaged"):
        sessions.import_bundle(packed(bad))
    assert sorted(p.name for p in sessions.folder.iterdir()) == before
