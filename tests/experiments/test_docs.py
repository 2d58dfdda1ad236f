import re
import sys

import pytest

from experiments.docs import (
    PACKAGES,
    build,
    docstring,
    lesson,
    literal_blocks,
    modules_of,
    room_map,
    rooms,
)


def test_the_front_page_has_a_row_for_every_room():
    text = room_map()
    for package in PACKAGES:
        assert f"\n## {package}\n" in text
    for room in ("models.scenes", "diagrams.station", "irl.mdp", "experiments.kit"):
        (row,) = re.findall(rf"^\| `{room}` \| (.+) \|$", text, re.MULTILINE)
        assert len(row) > 10
    assert "`experiments.docs`" in text
    assert "peers" not in text
    assert "__main__" not in text


def test_rooms_come_as_the_docstring_names_them(tmp_path, monkeypatch):
    package = tmp_path / "house"
    package.mkdir()
    for name in ("attic", "cellar", "hall", "_dust", "__main__"):
        (package / f"{name}.py").write_text(f'"""The {name}."""\n')
    (package / "__init__.py").write_text('"""Enter by the `hall`, then `house.cellar`."""\n')
    monkeypatch.syspath_prepend(tmp_path)
    assert rooms("house") == ["house.hall", "house.cellar", "house.attic"]
    assert modules_of("house") == ["house", *rooms("house")]
    assert docstring("house.hall") == "The hall."
    assert "house.hall" not in sys.modules  # read, not run


def test_a_script_of_cells_becomes_text_and_code():
    script = '"""A title."""\n# %% [markdown]\n# ## One\n#\n# Words.\n\n# %%\nx = 1  # why\n'
    assert lesson(script) == "## One\n\nWords.\n\n```python\nx = 1  # why\n```"


def test_drawings_keep_their_lines():
    drawing = "Ports.\n\n::\n\n       ┌─┐\n    a ─┤ │\n\nAll of them, in order::\n\n    b\n"
    text = literal_blocks(drawing)
    assert "```text\n   ┌─┐\na ─┤ │\n```" in text
    assert "All of them, in order:\n\n```text\nb\n```" in text
    assert "::" not in text
    assert literal_blocks("f(x::y)") == "f(x::y)\n"


def test_what_has_a_page():
    names = [name for package in PACKAGES for name in modules_of(package)]
    assert len(names) == len(set(names))
    assert {"irl", "irl.active", "irl.baselines.birl", "models.motion.planner"} <= set(names)
    # Programs of another environment, which import what is not installed here.
    assert not [name for name in names if "peers" in name or "__main__" in name]


def test_pages_need_no_network(tmp_path):
    pytest.importorskip("pdoc")
    assert build(tmp_path, ["irl.domains"]) == 3
    pages = {str(p.relative_to(tmp_path)): p.read_text() for p in tmp_path.rglob("*.html")}
    assert pages.keys() == {
        "index.html",
        "irl/domains.html",
        "irl/domains/gridworld.html",
        "irl/domains/sailing.html",
    }
    assert 'href="irl/domains/gridworld.html"' in pages["index.html"].replace('"./', '"')
    assert (tmp_path / "search.js").is_file()
    for text in pages.values():
        # What a browser would fetch: scripts, styles, pictures.
        assert not re.search(r"""<(script|img)[^>]*\ssrc=["']?https?:""", text)
        assert not re.search(r"""<link[^>]*\shref=["']?https?:""", text)
        assert "@import" not in text
