"""`planarfriction identify joint`: friction of a joint from its logs, as a subcommand of `identify`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from planarfriction.cli.options import FILE

NAME = "joint"

SHORT_HELP = "Estimate the friction of a joint from a torque, a voltage or the goal of a servo."


@click.command(name=NAME, short_help=SHORT_HELP)
@click.argument("logs", metavar="LOG...", type=FILE, nargs=-1, required=True)
@click.option("--mass", type=float, default=0.0, help="Mass at the end of a pendulum in kg.")
@click.option("--length", type=float, default=0.0, help="Length of the pendulum in m.")
@click.option("--arm-mass", type=float, help="Mass of its arm in kg.")
@click.option("--inertia", type=float, help="Moment of inertia, without the pendulum, in kg m^2. Default: estimated.")
@click.option("--torque-gain", type=float, help="kt/R in N m/V. Default: estimated.")
@click.option("--kp", type=float, multiple=True, help="Gain of the servo; once for each log, or once for all.")
@click.option("--gain", type=float, default=1.0, show_default=True, help="Duty per rad at a gain of 1.")
@click.option("--supply", type=float, help="Voltage of the servo in V.")
@click.option("--sag", type=float, default=0.0, show_default=True, help="Voltage lost at full duty in V.")
@click.option("--terms", default="auto", show_default=True, help="load,stribeck,bristles,directional; none; or auto.")
@click.option("--out", type=FILE, help="Folder for the estimates (JSON), the picture (PNG) and C source.")
def joint(
    logs: tuple[Path, ...],
    torque_gain: float | None,
    kp: tuple[float, ...],
    gain: float,
    supply: float | None,
    sag: float,
    terms: str,
    out: Path | None,
    **plant: Any,
) -> int:
    """Estimate the friction of a joint from logs of its motion; say what the logs leave open.

    Each LOG is a CSV file with a heading and the columns t, q and one of torque, voltage (or duty and supply) and goal
    in s, rad, N m and V; enabled, dq and external are read too. A goal needs --kp and --supply. Terms of the friction
    are kept only if they predict left-out logs better.

    \b
    Examples:
      planarfriction identify joint arm.csv --inertia 0.05
      planarfriction identify joint a.csv b.csv c.csv d.csv --mass 0.5 --length 0.1 --kp 200 --supply 7.4 --gain 0.003
    """
    from planarfriction.cli.console import note, work_progress
    from planarfriction.cli.output import slug, write_picture
    from planarfriction.errors import InvalidValueError
    from planarfriction.export.joint import export_joint_c
    from planarfriction.joints import Drive, JointLog, Plant, identify_joint
    from planarfriction.writing import make_folder, write_text

    if len(kp) not in (0, 1, len(logs)):
        raise InvalidValueError("--kp", "be given once, or once for each log", f"{len(kp)} times")
    if kp and supply is None:
        raise InvalidValueError("--supply", "be given with --kp", "none")
    gains = (kp * len(logs) if len(kp) == 1 else kp) or (None,) * len(logs)
    drives = [None if each is None else Drive(each, supply or 0.0, gain, sag) for each in gains]
    read = [JointLog.from_csv(path, drive=drive) for path, drive in zip(logs, drives, strict=True)]
    words = terms.split(",") if terms not in ("auto", "none") else terms if terms == "auto" else ()
    if out is not None:
        make_folder(out)
    with work_progress("identifying") as progress:
        fit = identify_joint(read, Plant(**plant), torque_gain=torque_gain, terms=words, progress=progress)
    print(fit.table())
    if out is not None:
        stem = slug(read[0].name)
        write_text(out / f"{stem}-joint.json", json.dumps(fit.to_dict(), indent=2) + "\n")
        files = [out / f"{stem}-joint.json", write_picture(fit.plot(), out / f"{stem}-joint.png")]
        for file in [*files, *export_joint_c(fit.friction, out, name="friction")]:
            note(f"wrote {file}")
    return 0
