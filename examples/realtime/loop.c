/* A body on a friction patch, in a loop at 1 kHz: pushed harder and harder until it slides, then let go.
 *
 * The twist at the end of a step is found together with the wrench there, M (V+ - V)/dt = applied + W(V+), by Newton
 * steps from the derivatives of the library. Prints the time, the speed and the friction force every 0.1 s.
 */
#include "friction.h"

#include <stdio.h>
#include <string.h>

enum { TRIES = 20 };

static const double mass = 0.2, inertia = 1e-4, dt = 1e-3, load = 2.0, enough = 1e-12;

/* Solve a [3][3] x = b in place by elimination; the matrix of a friction step is positive definite. */
static void solve(double a[3][3], double b[3])
{
    int i, j, k;
    for (i = 0; i < 3; ++i) {
        for (j = i + 1; j < 3; ++j) {
            const double c = a[j][i] / a[i][i];
            for (k = i; k < 3; ++k) {
                a[j][k] -= c * a[i][k];
            }
            b[j] -= c * b[i];
        }
    }
    for (i = 2; i >= 0; --i) {
        for (k = i + 1; k < 3; ++k) {
            b[i] -= a[i][k] * b[k];
        }
        b[i] /= a[i][i];
    }
}

/* Advance the state of the contact and the twist of the body by a period. */
static int advance(double *state, double twist[3], const double applied[3], double wrench[3])
{
    static friction_slopes slopes; /* large: not on the stack */
    const double body[3] = { mass / dt, mass / dt, inertia / dt };
    double ahead[3] = { twist[0], twist[1], twist[2] }, next[FRICTION_STATES];
    int i, j, k;
    for (k = 0; k < TRIES; ++k) {
        double matrix[3][3], gap[3], change = 0.0;
        memcpy(next, state, sizeof next);
        if (friction_step_slopes(&friction_default, next, ahead, load, dt, wrench, &slopes) != FRICTION_OK) {
            return 0;
        }
        for (i = 0; i < 3; ++i) {
            gap[i] = applied[i] + wrench[i] - body[i] * (ahead[i] - twist[i]);
            for (j = 0; j < 3; ++j) {
                matrix[i][j] = (i == j ? body[i] : 0.0) - slopes.wrench_twist[i][j];
            }
        }
        solve(matrix, gap);
        for (i = 0; i < 3; ++i) {
            ahead[i] += gap[i];
            change += gap[i] * gap[i];
        }
        if (change < enough * enough) {
            break;
        }
    }
    memcpy(state, next, sizeof next);
    memcpy(twist, ahead, sizeof ahead);
    return 1;
}

int main(void)
{
    double state[FRICTION_STATES], twist[3] = { 0.0, 0.0, 0.0 }, wrench[3];
    int i;
    friction_rest(state);
    for (i = 0; i < 1000; ++i) {
        const double applied[3] = { i < 700 ? 4e-3 * i : 0.0, 0.0, 0.0 };
        if (!advance(state, twist, applied, wrench)) {
            return 1;
        }
        if (i % 100 == 99) {
            printf("%.1f %.9f %.9f\n", (i + 1) * dt, twist[0], wrench[0]);
        }
    }
    return 0;
}
