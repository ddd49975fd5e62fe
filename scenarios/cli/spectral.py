"""The commands of the frequency domain: `tlpsim spectral`, `tlpsim compare` and `tlpsim sensitivity`."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.whole_file import require_writable
from tlpsim.scenarios.cli import completion
from tlpsim.scenarios.cli.endings import interruptible
from tlpsim.scenarios.cli.options import Duration, Json, ScenarioFile, Seed, Settings, load, print_json
from tlpsim.scenarios.terminal import say

Workers = Annotated[
    int | None, typer.Option("--workers", metavar="N", help="Processes at a time; as many as cores without it.")
]


def spectral(
    scenario: ScenarioFile,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="The response with its spectra (HDF5).")
    ] = None,
    duration: Duration = None,
    settings: Settings = None,
    json: Json = False,
) -> None:
    """Analyse a scenario in the frequency domain: means, spreads, extremes, tensions and modes, in seconds."""
    with interruptible(lambda: "nothing was written"):
        from tlpsim.scenarios.json_content import response_content
        from tlpsim.scenarios.spectral import spectral_response
        from tlpsim.scenarios.spectral_file import write_spectral
        from tlpsim.scenarios.spectral_tables import print_response

        chosen = load(scenario, duration, None, settings)
        require_writable(output)
        response = spectral_response(chosen)
        if output is not None:
            write_spectral(response, chosen, output)
    if json:
        print_json(response_content(response, chosen.title, chosen.simulation.duration))
    else:
        print_response(response, chosen.title, chosen.simulation.duration)
    if output is not None:
        say(f"response: {output}", aside=json)


def compare(
    scenario: ScenarioFile,
    records: Annotated[int, typer.Option("--records", metavar="N", help="Records of the time domain.")] = 24,
    duration: Duration = None,
    seed: Seed = None,
    settings: Settings = None,
    cosimulation: Annotated[
        bool, typer.Option("--cosimulation", help="Records by the scenario's FMUs, not by one loop.")
    ] = False,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="The comparison with its spectra (HDF5).")
    ] = None,
    paper: Annotated[bool, typer.Option("--paper", help="Table I of Li and Kareem (1990) beside ours.")] = False,
    workers: Workers = None,
    json: Json = False,
) -> None:
    """Analyse a scenario in both domains: the paper's Table I by each, extremes, and what they cost."""
    with interruptible(lambda: "nothing was written"):
        from tlpsim.scenarios.compare import compare as analyse
        from tlpsim.scenarios.compare import comparison_json, write_comparison
        from tlpsim.scenarios.compare_tables import print_comparison
        from tlpsim.scenarios.progress import case_bar

        chosen = load(scenario, duration, seed, settings)
        require_writable(output)
        with case_bar("records") as tell:
            found = analyse(chosen, records, cosimulation=cosimulation, workers=workers, progress=tell)
        if output is not None:
            write_comparison(found, output)
    if json:
        typer.echo(comparison_json(found))
    else:
        print_comparison(found, paper)
    if output is not None:
        say(f"comparison: {output}", aside=json)


def sensitivity(
    scenario: ScenarioFile,
    change: Annotated[str, typer.Option("--change", metavar="P", help="Up and down, as 10% or 0.1.")] = "10%",
    turn: Annotated[str, typer.Option("--turn", metavar="B", help="The same of headings, degrees.")] = "10",
    parameters: Annotated[
        str | None,
        typer.Option(
            "--parameters",
            metavar="KEY,...",
            help="Keys to change, as in wind.speed,waves.peak_period.",
            autocompletion=completion.parameters,
        ),
    ] = None,
    everything: Annotated[
        bool, typer.Option("--all", help="Mass and draught too, whose hydrodynamics take some 25 s a case.")
    ] = False,
    duration: Duration = None,
    settings: Settings = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="All changes, .csv or .h5 (HDF5).")
    ] = None,
    figure: Annotated[Path | None, typer.Option("--figure", metavar="DIR", help="Folder for the figure.")] = None,
    workers: Workers = None,
    json: Json = False,
) -> None:
    """Change keys of the environment and of the platform up and down, and show what becomes of the response."""
    with interruptible(lambda: "nothing was written"):
        from tlpsim.scenarios.progress import case_bar
        from tlpsim.scenarios.quantities import HEADING, RATIO
        from tlpsim.scenarios.sensitivity import sensitivity as study
        from tlpsim.scenarios.sensitivity_output import (
            draw_sensitivity,
            print_sensitivity,
            require_output,
            sensitivity_json,
            write_sensitivity,
        )

        chosen = load(scenario, duration, None, settings)
        if everything and parameters is not None:
            raise ScenarioError("--all adds to the default parameters: leave it out, and name the keys in --parameters")
        if output is not None:
            require_output(output)
        require_writable(output)
        try:
            part, degrees = RATIO.parse(change), HEADING.parse(turn)
        except ValueError as error:
            raise ScenarioError(f"--change {change}, --turn {turn}: {error}") from None
        with case_bar("cases") as tell:
            found = study(
                chosen,
                None if parameters is None else [name.strip() for name in parameters.split(",") if name.strip()],
                change=part,
                turn=degrees,
                new_databases=everything,
                workers=workers,
                progress=tell,
            )
        if output is not None:
            write_sensitivity(found, output)
        drawn = () if figure is None else draw_sensitivity(figure, found)
    if json:
        typer.echo(sensitivity_json(found))
    else:
        print_sensitivity(found)
    if output is not None:
        say(f"sensitivity: {output}", aside=json)
    for path in drawn:
        say(path, aside=json)


def compare_figures(folder: Path, scenario: Path | None, settings: list[str] | None, comparison: Path | None) -> None:
    """Draw a comparison that a file holds, or that is made of a scenario by 24 records.

    Raises
    ------
    ScenarioError
        When there is neither, or the file is of another scenario than the one given.
    """
    from tlpsim.scenarios.compare import compare as analyse
    from tlpsim.scenarios.compare import read_comparison
    from tlpsim.scenarios.compare_figures import draw_comparison
    from tlpsim.scenarios.progress import case_bar

    with interruptible(lambda: "nothing was written"):
        chosen = None if scenario is None else load(scenario, None, None, settings)
        if comparison is not None:
            found = read_comparison(comparison)
            if chosen is not None and chosen.with_(simulation=dict(found.scenario.simulation)) != found.scenario:
                raise ScenarioError(
                    f"--comparison {comparison} is of another scenario than {scenario}, or of other settings: "
                    "leave --scenario out, or compare again"
                )
        elif chosen is not None:
            with case_bar("records") as tell:
                found = analyse(chosen, progress=tell)
        else:
            raise ScenarioError("the figures 'compare' need a --comparison of `tlpsim compare -o`, or a --scenario")
        for path in draw_comparison(folder, found):
            say(path)


def print_spectral_file(file: Path, json: bool) -> bool:
    """Print what a file of `tlpsim spectral`, `compare` or `sensitivity` holds; False where it is none of them."""
    from tlpsim.scenarios import compare, sensitivity_output, spectral_file
    from tlpsim.scenarios.compare_tables import print_comparison
    from tlpsim.scenarios.json_content import response_content
    from tlpsim.scenarios.json_text import json_text
    from tlpsim.scenarios.schema import Scenario
    from tlpsim.scenarios.spectral_tables import print_response

    attributes = spectral_file.read_head(file)
    form = attributes.get("format")
    if form not in (spectral_file.FORMAT, compare.FORMAT, sensitivity_output.FORMAT):
        return False
    if form == compare.FORMAT:
        comparison = compare.read_comparison(file)
        text, show = compare.comparison_json(comparison), partial(print_comparison, comparison)
    elif form == sensitivity_output.FORMAT:
        study = sensitivity_output.read_sensitivity(file)
        text, show = sensitivity_output.sensitivity_json(study), partial(sensitivity_output.print_sensitivity, study)
    else:
        response, scenario = spectral_file.read_spectral(file), Scenario.from_json(str(attributes["scenario"]))
        shown = response, scenario.title, scenario.simulation.duration
        text, show = json_text(response_content(*shown)), partial(print_response, *shown)
    if json:
        typer.echo(text)
    else:
        say(f"{file}: {form} of {attributes['created']}")
        show()
    return True
