"""A sweep's plan and what it came to as nested mappings, for JSON."""

from __future__ import annotations

from typing import Any

import numpy as np

from tlpsim.scenarios.problems import dotted
from tlpsim.scenarios.statistics.records import Estimate
from tlpsim.scenarios.sweep.outlook import Group, Outlook
from tlpsim.scenarios.sweep.plan import Plan, Sweep
from tlpsim.scenarios.sweep.table import FAILED, SweepTable


def plan_content(sweep: Sweep, plan: Plan) -> dict[str, Any]:
    """Cases with their settings, and jobs by case; of the time domain those of all cases."""
    jobs: dict[int, list[dict[str, Any]]] = {}
    for job in plan.jobs:
        jobs.setdefault(job.case, []).append(
            {"key": job.key, "domain": job.domain, "replicate": job.replicate, "seeds": job.seeds}
        )
    return {
        "kind": "sweep plan",
        "title": sweep.title,
        "keys": [dotted(key) for key in plan.keys],
        "worst": sweep.file.time.worst,
        "notes": plan.notes,
        "cases": [
            {
                "case": case.number,
                "key": case.key,
                "name": case.name,
                "variant": case.variant,
                "probability": case.probability,
                "settings": {dotted(key): value for key, value in case.settings.items()},
                "problem": case.problem,
                "jobs": jobs.get(case.number, []),
            }
            for case in plan.cases
        ],
    }


def sweep_content(table: SweepTable, found: Outlook) -> dict[str, Any]:
    """Counts, failed jobs and long-term results; the statistics of all jobs are in the summary."""
    columns = table.columns
    failed = np.flatnonzero(columns["status"] == FAILED)
    return {
        "kind": "sweep",
        "title": table.title,
        "cases": len(np.unique(columns["case"])),
        "jobs": table.planned,
        "done": table.rows - len(failed),
        "failed": [
            {
                name: columns[name][row].item() if hasattr(columns[name][row], "item") else columns[name][row]
                for name in ("case", "domain", "replicate", "error", *table.keys)
            }
            for row in failed
        ],
        "variants": table.variants,
        "notes": table.notes,
        "extremes": [
            {
                **_whose(group),
                "signal": each.signal,
                "unit": each.unit,
                "side": each.side,
                "covered": each.covered,
                "returns": [
                    {
                        "years": value.years,
                        "level": _estimate(value.level),
                        "governed_by": [
                            {"case": int(group.cases[part.state]), "sea_state": part.name, "share": part.share}
                            for part in value.contributions[:10]
                        ],
                    }
                    for value in each.returns
                ],
                "notes": each.notes,
            }
            for group, each in found.extremes
        ],
        "fatigue": [
            {
                **_whose(group),
                "signal": each.signal,
                "unit": each.unit,
                "slope": each.slope,
                "years": each.years,
                "range_at_1_hz": _estimate(each.range_at_1_hz),
                "damage": None if each.damage is None else _estimate(each.damage),
                "notes": each.notes,
            }
            for group, each in found.fatigue
        ],
    }


def _whose(group: Group) -> dict[str, Any]:
    return {"variant": group.variant, "domain": group.domain}


def _estimate(value: Estimate) -> dict[str, float]:
    return {"value": value.value, "low": value.low, "high": value.high}
