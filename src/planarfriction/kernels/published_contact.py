"""A contact of the published reduced model as the solver calls it (see `contacts.ModelFunctions`)."""

from __future__ import annotations

from typing import NamedTuple

from planarfriction import formulas
from planarfriction.formulas import LawNumbers
from planarfriction.kernels import entry, inlined, published
from planarfriction.kernels.contacts import ModelFunctions
from planarfriction.kernels.pointers import doubles, matrix, vector
from planarfriction.kernels.records import reader

LINEAR = 27
"""Numbers of a linearisation."""


class Shape(NamedTuple):
    """A patch about its centre of pressure, in the axes of its friction metric."""

    centre_x: float
    centre_y: float
    contact_radius: float
    second_moment: float


class Root(NamedTuple):
    """Symmetric root of the friction metric."""

    xx: float
    xy: float
    yy: float


class PublishedContact(NamedTuple):
    """A contact of the published reduced model."""

    law: LawNumbers
    shape: Shape
    root: Root
    kind: int
    """Of the limit surface (see `kernels.surfaces`)."""
    size: int
    data: int
    """Where its numbers are."""


read = reader(PublishedContact)


@inlined
def _through(root, x, y):
    """A velocity in the axes of the metric, or a force out of them: times the symmetric root."""
    return root.xx * x + root.xy * y, root.xy * x + root.yy * y


@inlined
def _surface(own):
    return own.kind, 0, own.size


@entry
def evaluate(contact, z, v, zdot, w):
    """See `ModelFunctions`."""
    own, v, w = read(contact), doubles(v), doubles(w)
    vx, vy = _through(own.root, v[0], v[1])
    fx, fy, w[2] = published.evaluate(
        own.law, doubles(z), vx, vy, v[2], own.shape, _surface(own), doubles(own.data), doubles(zdot)
    )
    w[0], w[1] = _through(own.root, fx, fy)


@entry
def linearise(contact, z, v, lin):
    """See `ModelFunctions`."""
    own, v = read(contact), doubles(v)
    vx, vy = _through(own.root, v[0], v[1])
    lin = vector(lin, LINEAR)
    published.linearise(own.law, doubles(z), vx, vy, v[2], own.shape, _surface(own), doubles(own.data), lin)


@entry
def factor(contact, z, shift, lin, stiffness):
    """See `ModelFunctions`."""
    own, s = read(contact), matrix(stiffness, 3, 3)
    published.factor(own.law, shift, own.shape, doubles(lin), s)
    for i in range(3):
        s[i, 0], s[i, 1] = _through(own.root, s[i, 0], s[i, 1])
    for i in range(3):
        s[0, i], s[1, i] = _through(own.root, s[0, i], s[1, i])


@entry
def eliminate(contact, z, shift, r, lin, w):
    """See `ModelFunctions`."""
    own, w = read(contact), doubles(w)
    fx, fy, w[2] = published.eliminate(own.law, shift, doubles(r), own.shape, doubles(lin))
    w[0], w[1] = _through(own.root, fx, fy)


@entry
def back_substitute(contact, z, r, dv, lin, out):
    """See `ModelFunctions`."""
    own, v = read(contact), doubles(dv)
    vx, vy = _through(own.root, v[0], v[1])
    published.back_substitute(doubles(r), vx, vy, v[2], own.shape, doubles(lin), doubles(out))


@entry
def change(contact, z, zdot, lin, dz, dzdot, rows, friction, size):
    """See `ModelFunctions`; of an isotropic patch."""
    own, rows = read(contact), matrix(rows, 4, 3)
    law, lin, zdot, dz, out = own.law, doubles(lin), doubles(zdot), doubles(dz), doubles(dzdot)
    v, w, dv, dw = rows[0], rows[1], rows[2], rows[3]
    cx, cy, r = own.shape.centre_x, own.shape.centre_y, own.shape.contact_radius
    spin = dv[2] + size * v[2]
    ux, uy, us = dv[0] - spin * cy, dv[1] + spin * cx, r * spin
    zx, zy, zs = lin[4], lin[5], lin[6]
    ax, ay, a_s = dz[0] - friction * zx, dz[1] - friction * zy, dz[2] / r - (size + friction) * zs
    k = lin[1] * ax + lin[2] * ay + lin[3] * a_s
    out[0] = lin[7] * ux + lin[8] * uy + lin[9] * us - lin[0] * ax - zx * k
    out[1] = lin[10] * ux + lin[11] * uy + lin[12] * us - lin[0] * ay - zy * k
    out[2] = r * (lin[13] * ux + lin[14] * uy + lin[15] * us - lin[0] * a_s - zs * k) + size * zdot[2]
    dw[0] = formulas.traction(dz[0], out[0], ux, law)
    dw[1] = formulas.traction(dz[1], out[1], uy, law)
    tau = formulas.traction(dz[2], out[2], own.shape.second_moment * (spin + size * v[2]), law)
    dw[2] = tau + cx * dw[1] - cy * dw[0] + size * (cx * w[1] - cy * w[0])


FUNCTIONS = ModelFunctions(evaluate, linearise, factor, eliminate, back_substitute, change)
