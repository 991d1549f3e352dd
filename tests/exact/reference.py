"""High-precision references for the tests of src/integrate/exact (mpmath, 60 digits). Prints Rust arrays of the nearest doubles."""

from mpmath import cos, diag, exp, expm, findroot, matrix, mp, mpf, pi, sin

mp.dps = 60


def bridge_c():
    """Bridge on V1 = 10 cos(1e4 t), diodes of 0.21 V, Cf = 300 nF, R = 1 kOhm, Cf empty at the start.

    A pair conducts while i = Cf s u' + (s u - 0.42)/R >= 0 with v = s u - 0.42; blocked, v decays with R Cf until
    it meets s u - 0.42 of the other half wave.
    """
    w, cf, r, drop = mpf(10) ** 4, mpf(3) / 10**7, mpf(1000), mpf(42) / 100
    u = lambda t: 10 * cos(w * t)
    du = lambda t: -10 * w * sin(w * t)
    current = lambda t, s: cf * s * du(t) + (s * u(t) - drop) / r
    end = mpf(5) / 1000
    pieces = []  # (from, kind, data)
    t, s = mpf(0), 1
    while t < end:
        # conducting from t: first zero of the current after the crest
        crest = t if not pieces else findroot(du, pi / w * round(t * w / pi))
        low, high = max(t, crest), crest + pi / (2 * w)
        off = findroot(lambda x: current(x, s), (low, high), solver="anderson", tol=mpf(10) ** -100)
        pieces.append((t, "on", s))
        v = s * u(off) - drop
        pieces.append((off, "off", v))
        s = -s
        meet = lambda x: v * exp(-(x - off) / (r * cf)) - (s * u(x) - drop)
        crest = pi / w * round(off * w / pi + mpf(1))
        t = findroot(meet, (crest - pi / (2 * w), crest), solver="anderson", tol=mpf(10) ** -100)
    switching = [p[0] for p in pieces[1:] if p[0] < end]

    def value(x):
        start, kind, data = [p for p in pieces if p[0] <= x][-1]
        if kind == "on":
            return data * u(x) - drop
        return data * exp(-(x - start) / (r * cf))

    times = [mpf(k) / 10**4 for k in (1, 2, 5, 10, 20, 30, 40, 50)]
    print("const BRIDGE_C_SWITCHING: [f64; %d] = [" % len(switching))
    print("".join("    %r,\n" % float(x) for x in switching) + "];")
    print("const BRIDGE_C_VALUES: [f64; 8] = [")
    print("".join("    %r,\n" % float(value(x)) for x in times) + "];")


def graded():
    """RC line of 1 Ohm resistors, capacitors 1, 10^-k/4 ... 10^-k F, the first charged to 1 V, the last node at ground
    through 1 Ohm; voltages of the five capacitors after 1 s."""
    for k in (6, 9, 12, 15):
        c = [mpf(10) ** (-mpf(k) * i / 4) for i in range(5)]
        c = [mpf(mp.nstr(x, 16)) for x in c]
        g = matrix(5, 5)
        for i in range(5):
            g[i, i] = 1 if i == 0 else 2
            if i:
                g[i, i - 1] = g[i - 1, i] = -1
        half = [mp.sqrt(x) for x in c]
        sym = matrix(5, 5)
        for i in range(5):
            for j in range(5):
                sym[i, j] = -g[i, j] / (half[i] * half[j])
        mp.dps = 120
        values, vectors = mp.eigsy(sym)
        x0 = matrix([half[0], 0, 0, 0, 0])
        y = vectors * diag([exp(v) for v in values]) * (vectors.T * x0)
        print("// capacitors", [mp.nstr(x, 16) for x in c])
        print("(%d, [%s])," % (k, ", ".join(repr(float(y[i] / half[i])) for i in range(5))))
        mp.dps = 60


bridge_c()
graded()
