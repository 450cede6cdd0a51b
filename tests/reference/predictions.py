#!/usr/bin/env python3
"""Reference predictions of simple filters, by an implementation of their definitions that shares nothing with ours.

    predictions.py INPUT.csv RATE [PREDICTOR...]     prints predictor,t,x30,...,z10, a row per sample from the second on

INPUT.csv: t,stick,px,py,pz of one stick, mm, z up, RATE samples per second. Numbers have 50 digits, so that the rounding of the
result to a double is the only one. Definitions (mm, s; the same filter on each axis; variance of a measurement R = 0.0625; initial state:
first position, zero elsewhere, covariance diag(1e2, 1e6, 1e8) or its first two entries; a step propagates with F(dt), Q(dt), then
corrects; a prediction is F(lead) x; columns: leads of 1/30, 1/15, 1/10 s):
    thesis        constant acceleration, Q = diag(1, 20^2, 63^2) at every step (Friedmann 1992, 3.18 and 3.19)
    thesis_outer  the same with Q = xi xi^T, xi = (1, 20, 63)
    ca_1e9        constant acceleration, white jerk of density 1e9 mm^2/s^5
    cv_1e8        constant velocity, white acceleration of density 1e8 mm^2/s^3
    singer_3_1e10 acceleration that decays at 3 per second, driven by white noise of density 1e10
    bank_328      CV 1e7, CA 3e8, Singer 30 per second with 1e11: the one whose prediction made 1/15 s earlier was nearest (3.28)
    imm           interacting models: Singer 3 per second with 1e9, 3e10, 1e12; switching rate 10 per second out of each, equally to the others
    naive_4       mean of the last 4 samples (filled with the first), velocity from successive means
    difference_2  last sample, velocity from the last two
    ls_quadratic_4  least-squares parabola through the last 4 samples (filled with the first)
    double_exponential_0.9  s1 = a z + (1-a) s1, s2 = a s1 + (1-a) s2; (2 + r) s1 - (1 + r) s2, r = a lead / ((1-a) dt)
"""
import sys
from decimal import Decimal as D, getcontext

getcontext().prec = 50
LEADS = [D(1 / 30.0), D(1 / 15.0), D(1 / 10.0)]  # the doubles that stand for them
R = D("0.0625")


def product(a, b):
    return [[sum(x * y for x, y in zip(row, col)) for col in zip(*b)] for row in a]


def transposed(a):
    return [list(row) for row in zip(*a)]


def total(a, b):
    return [[x + y for x, y in zip(p, q)] for p, q in zip(a, b)]


class Model:
    """F and Q over a time, of `order` states per axis."""

    def __init__(self, order, density, decay=None, fixed=None):
        self.order, self.density, self.decay, self.fixed = order, D(density), decay and D(decay), fixed

    def f(self, t):
        if self.decay:
            a, e = self.decay, (-self.decay * t).exp()
            return [[D(1), t, (a * t - 1 + e) / a**2], [D(0), D(1), (1 - e) / a], [D(0), D(0), e]]
        full = [[D(1), t, t * t / 2], [D(0), D(1), t], [D(0), D(0), D(1)]]
        return [row[: self.order] for row in full[: self.order]]

    def q(self, t):
        if self.fixed:
            return self.fixed
        if self.decay:
            a = self.decay
            e1, e2 = (-a * t).exp(), (-2 * a * t).exp()
            i1, i2, s1 = (1 - e1) / a, (1 - e2) / (2 * a), (1 - e1 * (1 + a * t)) / a**2  # integrals of e^-as, e^-2as, s e^-as
            q33, q23, q22 = i2, (i1 - i2) / a, (t - 2 * i1 + i2) / a**2
            q13 = (a * s1 - i1 + i2) / a**2
            q12 = (a * t * t / 2 - t + 2 * i1 - a * s1 - i2) / a**3
            q11 = (a * a * t**3 / 3 - a * t * t + t + 2 * a * s1 - 2 * i1 + i2) / a**4
            m = [[q11, q12, q13], [q12, q22, q23], [q13, q23, q33]]
        elif self.order == 2:
            m = [[t**3 / 3, t * t / 2], [t * t / 2, t]]
        else:
            m = [[t**5 / 20, t**4 / 8, t**3 / 6], [t**4 / 8, t**3 / 3, t * t / 2], [t**3 / 6, t * t / 2, t]]
        return [[self.density * x for x in row] for row in m]


class Kalman:
    """Three axes, one covariance."""

    def __init__(self, model, z):
        self.model = model
        n = model.order
        self.x = [[v] + [D(0)] * (n - 1) for v in z]
        start = [D("1e2"), D("1e6"), D("1e8")]
        self.p = [[start[i] if i == j else D(0) for j in range(n)] for i in range(n)]

    def step(self, dt, z):
        f = self.model.f(dt)
        self.x = [[sum(a * b for a, b in zip(row, x)) for row in f] for x in self.x]
        p = total(product(product(f, self.p), transposed(f)), self.model.q(dt))
        self.variance = p[0][0] + R
        gain = [row[0] / self.variance for row in p]
        self.innovation = [v - x[0] for v, x in zip(z, self.x)]
        self.x = [[a + g * e for a, g in zip(x, gain)] for x, e in zip(self.x, self.innovation)]
        n = len(gain)
        left = [[(D(1) if i == j else D(0)) - (gain[i] if j == 0 else D(0)) for j in range(n)] for i in range(n)]
        noise = [[gi * R * gj for gj in gain] for gi in gain]
        self.p = total(product(product(left, p), transposed(left)), noise)  # Joseph form

    def at(self, lead):
        first = self.model.f(lead)[0]
        return [sum(a * b for a, b in zip(first, x)) for x in self.x]


class Bank:
    def __init__(self, rate, z):
        self.filters = [Kalman(m, z) for m in (Model(2, "1e7"), Model(3, "3e8"), Model(3, "1e11", 30))]
        self.back = round(rate / 15)
        self.made, self.chosen = [], 0
        self.keep()

    def keep(self):
        self.made.append([f.at(D(1) / 15) for f in self.filters])

    def step(self, dt, z):
        for f in self.filters:
            f.step(dt, z)
        if len(self.made) >= self.back:
            errors = [sum((a - b) ** 2 for a, b in zip(p, z)) for p in self.made[-self.back]]
            self.chosen = errors.index(min(errors))
        self.keep()

    def at(self, lead):
        return self.filters[self.chosen].at(lead)


class AxisKalman(Kalman):
    """As Kalman with a covariance per axis, which mixing needs; returns the log likelihood of a step, up to a constant."""

    def __init__(self, model, z):
        super().__init__(model, z)
        self.p3 = [self.p] * 3

    def step3(self, dt, z, x3, p3):
        log = D(0)
        self.x, self.p3 = list(x3), list(p3)
        for axis in range(3):
            one = Kalman(self.model, [z[axis]])
            one.x, one.p = [x3[axis]], p3[axis]
            one.step(dt, [z[axis]])
            self.x[axis], self.p3[axis] = one.x[0], one.p
            log -= (one.innovation[0] ** 2 / one.variance + one.variance.ln()) / 2
        return log


class Imm:
    def __init__(self, z):
        self.modes = [AxisKalman(Model(3, q, 3), z) for q in ("1e9", "3e10", "1e12")]
        self.mu = [D(1) / 3] * 3

    def step(self, dt, z):
        stay = (-10 * dt).exp()
        move = [[stay if i == j else (1 - stay) / 2 for j in range(3)] for i in range(3)]
        expected = [sum(move[i][j] * self.mu[i] for i in range(3)) for j in range(3)]
        mixed = []
        for j in range(3):
            w = [move[i][j] * self.mu[i] / expected[j] for i in range(3)]
            x = [[sum(w[i] * self.modes[i].x[axis][k] for i in range(3)) for k in range(3)] for axis in range(3)]
            p = [[[D(0)] * 3 for _ in range(3)] for _ in range(3)]
            for axis in range(3):
                for i in range(3):
                    d = [self.modes[i].x[axis][k] - x[axis][k] for k in range(3)]
                    p[axis] = total(p[axis], [[w[i] * (self.modes[i].p3[axis][r][c] + d[r] * d[c]) for c in range(3)] for r in range(3)])
            mixed.append((x, p))
        logs = []
        for j, (x, p) in enumerate(mixed):
            logs.append(self.modes[j].step3(dt, z, x, p))
        largest = max(logs)
        mu = [e * (l - largest).exp() for e, l in zip(expected, logs)]
        mu = [m / sum(mu) for m in mu]
        mu = [max(m, D("1e-6")) for m in mu]
        self.mu = [m / sum(mu) for m in mu]

    def at(self, lead):
        mean = [[sum(m * mode.x[axis][k] for m, mode in zip(self.mu, self.modes)) for k in range(3)] for axis in range(3)]
        first = self.modes[0].model.f(lead)[0]
        return [sum(a * b for a, b in zip(first, x)) for x in mean]


class Mean:
    def __init__(self, z):
        self.last = [z] * 4
        self.mean, self.velocity = z, [D(0)] * 3

    def step(self, dt, z):
        self.last = self.last[1:] + [z]
        mean = [sum(c) / 4 for c in zip(*self.last)]
        self.velocity = [(a - b) / dt for a, b in zip(mean, self.mean)]
        self.mean = mean

    def at(self, lead):
        return [m + lead * v for m, v in zip(self.mean, self.velocity)]


class Difference:
    def __init__(self, z):
        self.z, self.velocity = z, [D(0)] * 3

    def step(self, dt, z):
        self.velocity = [(a - b) / dt for a, b in zip(z, self.z)]
        self.z = z

    def at(self, lead):
        return [a + lead * v for a, v in zip(self.z, self.velocity)]


class Parabola:
    def __init__(self, z):
        self.last = [z] * 4

    def step(self, dt, z):
        self.last, self.dt = self.last[1:] + [z], dt

    def at(self, lead):
        powers = [[D(1)] + [(k * self.dt) ** n for n in range(1, 5)] for k in (-3, -2, -1)] + [[D(1)] + [D(0)] * 4]
        normal = [[sum(p[i + j] for p in powers) for j in range(3)] for i in range(3)]
        return [self.value(normal, [sum(p[i] * z[axis] for p, z in zip(powers, self.last)) for i in range(3)], lead) for axis in range(3)]

    @staticmethod
    def value(normal, right, lead):
        rows = [list(r) + [b] for r, b in zip(normal, right)]
        for i in range(3):
            pivot = max(range(i, 3), key=lambda r: abs(rows[r][i]))
            rows[i], rows[pivot] = rows[pivot], rows[i]
            for r in range(3):
                if r != i:
                    factor = rows[r][i] / rows[i][i]
                    rows[r] = [x - factor * y for x, y in zip(rows[r], rows[i])]
        c = [rows[i][3] / rows[i][i] for i in range(3)]
        return c[0] + c[1] * lead + c[2] * lead * lead


class Exponential:
    def __init__(self, z):
        self.a, self.one, self.two = D("0.9"), z, z

    def step(self, dt, z):
        self.dt = dt
        self.one = [self.a * v + (1 - self.a) * s for v, s in zip(z, self.one)]
        self.two = [self.a * v + (1 - self.a) * s for v, s in zip(self.one, self.two)]

    def at(self, lead):
        r = self.a * lead / ((1 - self.a) * self.dt)
        return [(2 + r) * s - (1 + r) * u for s, u in zip(self.one, self.two)]


def diagonal(*values):
    return [[D(v) if i == j else D(0) for j in range(len(values))] for i, v in enumerate(values)]


XI = [D(1), D(20), D(63)]
PREDICTORS = {  # name: (makes one of the first position and the rate, steps of the nominal 1/rate)
    "thesis": (lambda z, rate: Kalman(Model(3, 0, fixed=diagonal(1, 400, 3969)), z), False),
    "thesis_outer": (lambda z, rate: Kalman(Model(3, 0, fixed=[[a * b for b in XI] for a in XI]), z), False),
    "ca_1e9": (lambda z, rate: Kalman(Model(3, "1e9"), z), False),
    "cv_1e8": (lambda z, rate: Kalman(Model(2, "1e8"), z), False),
    "singer_3_1e10": (lambda z, rate: Kalman(Model(3, "1e10", 3), z), False),
    "bank_328": (lambda z, rate: Bank(rate, z), True),
    "imm": (lambda z, rate: Imm(z), True),
    "naive_4": (lambda z, rate: Mean(z), False),
    "difference_2": (lambda z, rate: Difference(z), False),
    "ls_quadratic_4": (lambda z, rate: Parabola(z), True),
    "double_exponential_0.9": (lambda z, rate: Exponential(z), False),
}


def main():
    file, rate = sys.argv[1], int(sys.argv[2])
    with open(file) as lines:
        rows = [line.rstrip("\n").split(",") for line in lines if line[0].isdigit()]
    samples = [(D(float(r[0])), [D(float(v)) for v in r[2:5]]) for r in rows]
    print("predictor,t,x30,y30,z30,x15,y15,z15,x10,y10,z10")
    for name in sys.argv[3:] or PREDICTORS:
        make, nominal = PREDICTORS[name]
        predictor = make(samples[0][1], rate)
        for (before, _), (t, z) in zip(samples, samples[1:]):
            predictor.step(D(1) / rate if nominal else t - before, z)
            values = [float(v) for lead in LEADS for v in predictor.at(lead)]
            print(",".join([name, repr(float(t))] + [repr(v) for v in values]))


if __name__ == "__main__":
    main()
