"""What scene files refuse: each mistake in one line with its file, its table and what is wanted."""

from pathlib import Path

import pytest

import planarfriction as pf
from planarfriction.errors import FileError
from tests.support.refusals import refusal

PATCHES = {
    "shape = 'cells', areas = [1]": "missing key 'positions'",
    "shape = 'none'": "shape must be one of disc, disc-published, rectangle, ring, line, polygon, points,",
    "shape = 3": "published, cells, got 3",
    "radius = 1": "missing key 'shape'",
    "shape = 'disc', radius = 0.01, pressure = {c = 1}": "must be a table with law = uniform or linear_gradient",
    "shape = 'disc', radius = 0.01, pressure = 'hard'": "pressure law must be one of uniform, linear_gradient,",
    "shape = 'disc', radius = 0.01, pressure = {law = 'soft_finger'}": "soft_finger pressure must have the key 'c'",
    "shape = 'pressure-map', files = ['pad.npy'], width = 0.01": "loads must be given: the normal force of each",
    "shape = 'pressure-map', files = 'pad.npy'": "files must be a list of paths, got 'pad.npy'",
    "shape = 'pressure-map', files = [3], loads = [1]": "files must be the path of a file, got 3",
    "shape = 'pressure-map', file = ''": "file must be the path of a file, got ''",
    "shape = 'pressure-map'": "pressure map must have either file or values (or files, one for each load), got none",
    "shape = 'published', name = 'Lin'": "published patch must be one of Square, Circle, Line, LineGrad,",
    "shape = 'disc', radius = 0.01, metric = {along = 1}": "[contact.patch.metric]: missing key 'across'",
    "shape = 'disc', radius = 0.01, metric = {along = 1, across = -1.5}": "[contact.patch.metric]: across must be > 0",
    "shape = 'dics', radius = 0.01": "got 'dics' (did you mean 'disc'?)",
    "shape = 'disc', diameter = 0.01": "unknown key 'diameter' (valid: shape, radius, cells, pressure, name)",
}
"""Patch -> words."""

CHANGES = {
    ("t_end = 0.05", "t_end = -1"): "scene.toml: t_end must be > 0, got -1",
    ("t_end = 0.05", ""): "scene.toml: missing key 't_end'",
    ("mass", "mas"): "[body]: unknown key 'mas' (did you mean 'mass'?)",
    (
        "mu_c = 0.7",
        "mu_c = 0.7, mu_s = 0.5",
    ): "[contact.law]: mu_s must be >= mu_c, got mu_s=0.5, mu_c=0.7",
    ("sine", "sin"): "[contact.normal_force]: unknown key 'sin' (did you mean 'sine'?)",
    ("amplitude = 0.5, ", ""): "[contact.normal_force.sine]: missing key 'amplitude'",
    (
        "law",
        "model = {kind = 'reduced', cells = 0}\nlaw",
    ): "[contact.model]: cells must be an integer >= 1, got 0",
    (
        "law",
        "position = [1, 2, 3]\nlaw",
    ): "[contact]: position of contact 'contact' must have shape [2], got shape [3]",
    (
        "[[contact]]",
        "[spring]\nstiffness = 1\ndamp = 2\n[[contact]]",
    ): "[spring]: unknown key 'damp' (did you mean 'damping'?)",
    (
        "t_end",
        "start = 'sliding'\nt_end",
    ): "initial velocity must not be zero if start is 'sliding', got (0.0, 0.0, 0.0)",
}
"""Change of the scene -> words."""

SCENE = """t_end = 0.05
body = {mass = 0.2, size = [0.1, 0.05]}
[[contact]]
patch = {shape = "disc", radius = 0.01, cells = 5}
law = {mu_c = 0.7}
normal_force = {sine = {offset = 2.0, amplitude = 0.5, frequency = 2.0, t_end = 0.05}}
"""


def refused(text, folder):
    path = Path(folder) / "scene.toml"
    path.write_text(text, encoding="utf-8")
    return refusal(pf.Scene.from_file, path, kind=FileError)


@pytest.mark.parametrize("patch", PATCHES)
def test_a_mistake_in_a_patch_is_named(patch, tmp_path):
    told = refused(
        SCENE.replace('shape = "disc", radius = 0.01, cells = 5', patch), tmp_path
    )
    assert "scene.toml: [contact.patch" in told and PATCHES[patch] in told


@pytest.mark.parametrize("change", CHANGES)
def test_a_mistake_in_a_scene_is_named(change, tmp_path):
    assert CHANGES[change] in refused(SCENE.replace(*change, 1), tmp_path)
