"""The rooms keep to themselves: which of the project's packages each one imports."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
# room -> prefixes of what it may import of ours, beside itself
MAY_IMPORT = {
    "loads": (),
    "fmus": ("tlpsim.loads",),
    "orchestrator": ("tlpsim.loads.filters", "tlpsim.loads.errors"),
    "scenarios": ("tlpsim.loads", "tlpsim.fmus", "tlpsim.orchestrator"),
}


def imports_of_ours(path: Path) -> set[str]:
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative imports hide which room is meant"
            module = node.module or ""
            names |= {f"{module}.{alias.name}" for alias in node.names}
    return {name for name in names if name.split(".")[0] == "tlpsim"}


@pytest.mark.parametrize("room", MAY_IMPORT)
def test_a_room_imports_only_what_it_may(room: str) -> None:
    allowed = (f"tlpsim.{room}", *MAY_IMPORT[room])
    files = sorted((ROOT / room).rglob("*.py"))
    assert files
    astray = {
        f"{path.relative_to(ROOT)}: {name}"
        for path in files
        for name in imports_of_ours(path)
        if not any(name == prefix or name.startswith(prefix + ".") for prefix in allowed)
    }
    assert not astray


def test_fmi_stays_out_of_the_physics() -> None:
    for path in (ROOT / "loads").rglob("*.py"):
        assert "pythonfmu" not in path.read_text()
        assert "fmpy" not in path.read_text()
