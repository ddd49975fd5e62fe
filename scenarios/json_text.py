"""JSON for other programs: what is not known is null, since JSON has no NaN."""

import json
import math
from collections.abc import Mapping
from typing import Any


def json_text(content: Any) -> str:
    """Nested mappings and sequences as JSON text, with null for numbers that are not finite."""
    return json.dumps(_without_nan(content), indent=1, ensure_ascii=False)


def _without_nan(value: Any) -> Any:
    """Nested content with None for numbers that are not finite."""
    if isinstance(value, Mapping):
        return {key: _without_nan(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_without_nan(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
