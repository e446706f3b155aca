"""Independent oracle for the LeBus models: a chain of springs with Coulomb friction at its nodes.

Displacement-based finite elements, quasi-static, one linear solve per trial set of sliding nodes: no profiles, no
fronts, no memory but the node displacements. Chain order: driver, tendon a, follower, tendon b, driver. Displacements
count towards the driver end of tendon a, so the driver moves both ends of the chain by s_in.
"""

import numpy as np
from scipy.linalg import solve_banded


class Chain:
    """Tendon a, and tendon b if ``both``, of ``n`` elements each, at preload ``T_0`` [N].

    ``lam`` is the integral of mu dl/R from the driver, a function of the share of the path (array, 0 to 1). Each inner
    node carries the friction of its cell, the outermost ones that of the path's ends too.
    """

    def __init__(self, n, length, EA, T_0, lam, both):
        self.h, self.EA, self.T_0, self.n, self.both = length / n, EA, T_0, n, both
        self.last = 2 * n if both else n
        self.u = np.zeros(self.last + 1)
        edges = np.concatenate([[0.0], (np.arange(1, n - 1) + 0.5) / n, [1.0]])
        cells = np.diff(lam(edges))
        self.gain = np.exp(np.concatenate([[0.0], cells, [0.0], *([cells[::-1], [0.0]] if both else [])]))
        self.state = np.zeros(self.last + 1, dtype=int)
        self.state[self.gain == 1.0] = 1  # without friction a node always follows its neighbours

    @property
    def T(self):
        return self.T_0 + self.EA * (self.u[:-1] - self.u[1:]) / self.h

    def _solve(self, s_in, F, old):
        last, n, c = self.last, self.n, self.EA / self.h
        lower, main, upper, right = (np.zeros(last + 1) for _ in range(4))
        inner = np.arange(1, last)
        g = np.where(self.state > 0, self.gain, 1 / self.gain)
        slides = self.state != 0
        # T[j-1] = g T[j]
        main[:] = 1.0
        right[:] = old
        j = inner[slides[1:last]]
        lower[j], main[j], upper[j] = c, -c * (1 + g[j]), c * g[j]
        right[j] = self.T_0 * (g[j] - 1)
        main[0], right[0] = 1.0, s_in
        if self.both:
            lower[n], main[n], upper[n], right[n] = c, -2 * c, c, F
            main[last], right[last] = 1.0, s_in
        else:
            lower[n], main[n], right[n] = c, -c, F - self.T_0
        bands = np.zeros((3, last + 1))
        bands[0, 1:], bands[1], bands[2, :-1] = upper[:-1], main, lower[1:]
        return solve_banded((1, 1), bands, right)

    def move(self, s_in, F):
        """Equilibrium after the driver moved to ``s_in`` [m] at the load ``F`` [N]; returns s_out."""
        old = self.u.copy()
        rubs = self.gain > 1.0
        for _ in range(20 * self.last):
            self.u = self._solve(s_in, F, old)
            T = self.T
            before, after, gain = T[:-1], T[1:], self.gain[1:-1]
            stuck = rubs & (self.state == 0)
            to_plus, to_minus = stuck.copy(), stuck.copy()
            to_plus[1:-1] &= before - gain * after > 1e-9 * self.T_0
            to_minus[1:-1] &= after - gain * before > 1e-9 * self.T_0
            back = rubs & (self.state * (self.u - old) < -1e-12)
            if not (to_plus.any() or to_minus.any() or back.any()):
                break
            self.state[to_plus], self.state[to_minus], self.state[back] = 1, -1, 0
        else:
            raise AssertionError("no equilibrium found")
        return self.u[self.n]
