"""Every law with every model and precision is source that compilers have nothing to say about."""

import shutil
import subprocess
from dataclasses import replace

import pytest

import planarfriction as pf
from planarfriction.laws import CoulombStribeck, Dahl
from planarfriction.online import FrictionObserver, Hold
from tests.support.c_libraries import FEW, FOLLOWING, STRICT

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")

METRIC = FEW.with_friction_metric([[1.0, 0.2], [0.2, 1.5]])
LINE, SOFT = pf.ContactPatch.line(0.02, cells=4), FOLLOWING["soft"]().patch
ELLIPSOID = pf.LimitSurfaceEllipsoid(FEW)
LAWS = {
    "lugre": pf.LuGre(mu_s=1.2),
    "elasto-plastic": pf.LuGre(mu_s=1.2, elasto_plastic=0.9),
    "gamma": pf.LuGre(mu_s=1.2, gamma=1.3),
    "dahl": Dahl(),
    "creep": CoulombStribeck(),
}
MODELS = {
    "reduced": lambda law: pf.ReducedModel(FEW, law),
    "one disc": lambda law: pf.ReducedModel(FEW, law, cells=1),
    "points": lambda law: pf.DistributedModel(FEW, law),
    "metric": lambda law: pf.DistributedModel(METRIC, law),
    "line": lambda law: pf.ReducedModel(LINE, law),
    "soft": lambda law: pf.ReducedModel(SOFT, law, cells=8),
    "table": lambda law: pf.ReducedModelPublished(FEW, law),
    "ellipsoid": lambda law: pf.ReducedModelPublished(FEW, law, surface=ELLIPSOID),
    "pad": lambda law: pf.DistributedModel(FEW, law, pad=pf.Pad.at_load(2.0)),
    "soft layer": lambda law: pf.ReducedModel(
        SOFT, law, cells=8, pad=pf.Pad.layer(1e6, 2e-3)
    ),
}
HUNG = pf.Pad.measured(1e5, 0.4)
MODELS["face"] = lambda law: pf.DistributedModel(
    FEW, law if law.numbers.sigma_1 == 0.0 else replace(law, sigma_1=0.0), pad=HUNG
)
UNKNOWN = {("table", "creep"), ("ellipsoid", "creep")}
"""Models that do not take a law."""
QUICK, SLOW = ("points", "ellipsoid", "pad", "face"), pytest.mark.slow
WARNINGS = *STRICT, "-Wconversion", "-Wshadow"


def checked(folder, *files):
    """Let a compiler read sources without making code of them."""
    subprocess.run(["gcc", *WARNINGS, "-fsyntax-only", *files], cwd=folder, check=True)


@pytest.mark.parametrize("precision", ["double", "float"])
@pytest.mark.parametrize(
    "model",
    [each if each in QUICK else pytest.param(each, marks=SLOW) for each in MODELS],
)
def test_every_export_compiles_without_a_warning(model, precision, tmp_path):
    names = [law for law in LAWS if (model, law) not in UNKNOWN]
    files = [
        pf.export_c(
            MODELS[model](LAWS[law]),
            tmp_path,
            name=f"law_{i}",
            precision=precision,
            patches=1 + i % 3,
        )
        for i, law in enumerate(names)
    ]
    assert len(names) >= 4
    checked(
        tmp_path, *(file.name for each in files for file in each if file.suffix == ".c")
    )


def test_controllers_and_casadi_compile_without_a_warning(tmp_path):
    for surface in (ELLIPSOID, pf.LimitSurfaceTable(FEW)):
        model = pf.ReducedModelPublished(FEW, LAWS["elasto-plastic"], surface=surface)
        files = pf.export_c(
            model,
            tmp_path,
            casadi=True,
            controller=Hold(FrictionObserver(model)),
            patches=3,
        )
        checked(tmp_path, *(file.name for file in files if file.suffix == ".c"))


@pytest.mark.parametrize(
    "name", ["tilt", "math", "stddef", "_", "real", "int", "share", "x" * 40]
)
def test_every_name_compiles_or_is_refused(name, tmp_path):
    try:
        files = pf.export_c(MODELS["points"](LAWS["lugre"]), tmp_path, name=name)
    except pf.FrictionError as error:
        assert str(error).startswith("name must")
    else:
        checked(tmp_path, *(file.name for file in files if file.suffix == ".c"))
