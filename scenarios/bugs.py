"""Errors that are nobody's input: what is said of them."""

from __future__ import annotations

import os
import traceback


def bug_text(error: BaseException) -> str:
    """One line, "bug: TypeError: what it says (file.py:12)", with the place where it was raised if that is known."""
    said = " ".join(str(error).split())
    frames = traceback.extract_tb(error.__traceback__)
    place = f" ({os.path.basename(frames[-1].filename)}:{frames[-1].lineno})" if frames else ""
    return f"bug: {type(error).__name__}: {said}".removesuffix(": ") + place
