"""A page in the browser of a test, and what went wrong in it."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any


@dataclass
class OpenedPage:
    """A page of playwright, with the errors that it told and the files that it asked for."""

    page: Any
    messages: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)

    def visit(self, path: Path) -> None:
        """Open a report, until it has drawn itself."""
        # A warning is the driver's word on how fast it reads the pixels of the scene.
        self.page.on("console", lambda told: self.messages.append(told.text) if told.type == "error" else None)
        self.page.on("pageerror", lambda error: self.messages.append(str(error)))
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.goto(path.as_uri())
        self.page.evaluate("async () => { await window.tlpsimReady; }")

    def settled(self) -> None:
        """Wait until what was asked for is drawn."""
        self.page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
