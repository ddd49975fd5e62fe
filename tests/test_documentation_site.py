"""The documents as a site: it builds without a warning, has its generated parts, and a browser reads it offline."""

import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import typer
import yaml

from tlpsim.scenarios.cli.main import app
from tlpsim.scenarios.json_schema import scenario_schema

ROOT = Path(__file__).parent.parent
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
OUTSIDE = re.compile(r"<(?:script|link|img|iframe)\b[^>]*\b(?:src|href)=\"?(?:https?:)?//[^\">\s]+")


def module(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"{path.stem}_of_{path.parent.name}", path)
    assert spec is not None
    assert spec.loader is not None
    found = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = found  # where its dataclasses look for their annotations
    spec.loader.exec_module(found)
    return found


hooks = module(ROOT / "docs" / "hooks.py")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site as `make docs` builds it."""
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(folder)]
    environment = os.environ | {"NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    return folder


def text_of(site: Path, page: str) -> str:
    return (site / page).read_text(encoding="utf-8")


def test_every_page_is_in_the_navigation() -> None:
    """A page that is misspelt there would be left out of the site."""

    def targets(entries: list[Any]) -> Iterator[str]:
        for value in (value for entry in entries for value in entry.values()):
            yield from [value] if isinstance(value, str) else targets(value)

    named = set(targets(yaml.safe_load((ROOT / "mkdocs.yml").read_text())["nav"]))
    assert {str(path.relative_to(ROOT / "docs")) for path in (ROOT / "docs").rglob("*.md")} <= named


def test_nothing_is_fetched_from_elsewhere(site: Path) -> None:
    pages = sorted(site.rglob("*.html"))
    assert len(pages) > 15
    assert [found for page in pages for found in OUTSIDE.findall(page.read_text(encoding="utf-8"))] == []
    styles = "".join(path.read_text(encoding="utf-8") for path in site.rglob("*.css"))
    assert re.findall(r"@import|url\(\"?https?:", styles) == []


def test_no_marker_is_left(site: Path) -> None:
    for page in site.rglob("*.html"):
        assert "<!-- generated" not in page.read_text(encoding="utf-8"), page.name
        assert "<!-- long" not in page.read_text(encoding="utf-8"), page.name


def test_every_key_of_a_scenario_is_explained(site: Path) -> None:
    text = text_of(site, "scenario-keys.html")
    schema = scenario_schema()
    tables = [schema, *(each for name, each in schema["$defs"].items() if "properties" in each)]
    values = {key for table in tables for key, each in table["properties"].items() if "$ref" not in each}
    missing = [key for key in values - {"components", "connections"} if f"<code>{key}</code>" not in text]
    assert missing == []
    for table in ("[wind]", "[[wind.segments]]", "[components.NAME]", "[[events]]", "[coupling.iteration]"):
        assert f"{table}<" in text


def test_every_command_is_explained_with_its_options() -> None:
    text = hooks.commands()
    group: Any = typer.main.get_command(app)
    for name, command in group.commands.items():
        part = text.partition(f"\n### {name}\n")[2].partition("\n### ")[0]
        for option in (each for each in command.params if each.param_type_name == "option" and not each.hidden):
            assert all(f"`{each}`" in part for each in option.opts), (name, option.opts)


def test_figures_of_benchmarks_become_a_table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    report = module(ROOT / "benchmarks" / "report.py")

    def part(quick: bool) -> list[Any]:
        return [
            report.at_most("error | a", 0.5, 1.0, "%"),
            report.at_least("speed", 3.0, 4.0),
            report.Row(item="b", measured="7"),
        ]

    monkeypatch.setattr(sys, "argv", ["x.py", "--quick", "--json", str(tmp_path / "new" / "x.json")])
    with pytest.raises(SystemExit) as ended:
        report.main("Title", [part])
    assert ended.value.code == 1  # for the bound that is missed
    monkeypatch.setattr(hooks, "DATA", tmp_path / "new")
    lines = hooks.benchmark("x").splitlines()
    assert lines[0].startswith("`python benchmarks/x.py --quick`")
    assert lines[-3:] == ["| error \\| a | 0.5 % | ≤ 1 % | yes |", "| speed | 3 | ≥ 4 | **no** |", "| b | 7 |  |  |"]
    assert "`python benchmarks/y.py` measures" in hooks.benchmark("y")


def test_kept_figures_are_of_whole_benchmarks_that_keep_their_bounds() -> None:
    for path in sorted((ROOT / "docs" / "data").glob("*.json")):
        found = json.loads(path.read_text(encoding="utf-8"))
        if found.get("kind") != "comparison":
            assert not found["quick"], path.name
            assert (ROOT / "benchmarks" / f"{path.stem}.py").exists()
            assert [row["item"] for part in found["parts"] for row in part["rows"] if row["ok"] is False] == []


def test_every_benchmark_has_its_place() -> None:
    """Those that `make bench` runs."""
    named = re.search(r"^BENCHMARKS := (.*)$", (ROOT / "Makefile").read_text(), re.MULTILINE)
    assert named is not None
    page = (ROOT / "docs" / "validation.md").read_text(encoding="utf-8")
    assert [each for each in named[1].split() if f"<!-- generated: benchmark {each} -->" not in page] == []


def test_formulas_have_subscripts_and_code_has_none() -> None:
    html = "<p><em>y_n = h_{n−k} e^{−ikx}</em> some_name</p><code>a_b^{c}</code><p>e^{iωt}</p>"
    wanted = (
        "<p><em>y<sub>n</sub> = h<sub>n−k</sub> e<sup>−ikx</sup></em> some_name</p><code>a_b^{c}</code>"
        "<p>e<sup>iωt</sup></p>"
    )
    assert hooks.on_page_content(html) == wanted


# In a browser


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    api = pytest.importorskip("playwright.sync_api")
    if CHROMIUM is None:
        pytest.skip("no Chromium on the PATH")
    with api.sync_playwright() as playwright:
        found = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
        yield found
        found.close()


def test_it_reads_and_searches_from_the_disk(site: Path, browser: Any) -> None:
    """Without a server and without a network, and without an error in the console."""
    context = browser.new_context(offline=True, viewport={"width": 1280, "height": 800})
    page = context.new_page()
    asked: list[str] = []
    said: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.on("console", lambda message: said.append(message.text) if message.type in ("error", "warning") else None)
    page.on("pageerror", lambda error: said.append(str(error)))
    for name in ("index.html", "decisions/0001-multirate-coupling.html"):
        page.goto((site / name).as_uri())
        page.keyboard.press("/")
        page.keyboard.type("setdown", delay=20)
        page.wait_for_selector(".md-search-result__item a[href*='conventions.html']", state="attached", timeout=20000)
    assert said == []
    assert [url for url in asked if not url.startswith(("file:", "data:", "blob:"))] == []
    context.close()


@pytest.mark.parametrize("page", ["index.html", "scenario-keys.html", "theory.html", "tutorial.html"])
def test_pages_fit_a_phone(site: Path, browser: Any, page: str) -> None:
    """No page is wider than its screen; what is wider scrolls by itself."""
    context = browser.new_context(offline=True, viewport={"width": 390, "height": 800})
    opened = context.new_page()
    opened.goto((site / page).as_uri())
    assert opened.evaluate("document.documentElement.scrollWidth") <= 390
    broken = "[...document.images].filter(image => !image.complete || !image.naturalWidth).map(image => image.src)"
    assert opened.evaluate(broken) == []
    context.close()
