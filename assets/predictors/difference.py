#!/usr/bin/env python3
"""The predictor `difference` as an external one: the last two samples, extrapolated at constant velocity."""
import math, os, sys


def product(a, b):
    (aw, ax, ay, az), (bw, bx, by, bz) = a, b
    return (aw * bw - ax * bx - ay * by - az * bz, aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx, aw * bz + ax * by - ay * bx + az * bw)


def turned(q, last, ahead):
    """q, turned on by `ahead` times the shorter rotation that led to it from `last`."""
    w, x, y, z = product(q, (last[0], -last[1], -last[2], -last[3]))
    sine = math.copysign(math.sqrt(x * x + y * y + z * z), w)
    half = ahead * math.atan2(abs(sine), abs(w))
    share = math.sin(half) / sine if sine else 0.0
    return product((math.cos(half), share * x, share * y, share * z), q)


leads = [float(word) for word in sys.stdin.buffer.readline().split()[3:]]
os.write(1, b"position orientation\n")
last = None
for line in sys.stdin.buffer:
    if line == b"restart\n":
        last = None
        continue
    t, *p = map(float, line.split())
    q = p[3:] or (last[2] if last else [1.0, 0.0, 0.0, 0.0])
    t0, p0, q0 = last or (t - 1, p, q)
    answer = []
    for ahead in [lead / (t - t0) for lead in leads]:
        answer += [p[i] + ahead * (p[i] - p0[i]) for i in range(3)]
        answer += turned(q, q0, ahead)
    os.write(1, (" ".join(map(repr, answer)) + "\n").encode())
    last = t, p, q
