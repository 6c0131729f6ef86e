// Machines by hand in C++ with GCC vector extensions: what evaluate() is measured against.
// The 4-dof machine in two ways: the paper's (K of eq. 32, 6x6 Cholesky inverse), and one that uses all that is known of
// it (4x4). The hexapod and the Tripteron: K, then a 6x6 Cholesky inverse. The hexapod also as it is judged: with its
// singularity margin, which follows from the traces of K and C because its legs are equally stiff, and with its limits.
#include <cmath>
#include <cstdint>
#include <cstring>

#if defined(__AVX512F__)
constexpr int LANES = 8;
#elif defined(__AVX__)
constexpr int LANES = 4;
#else
constexpr int LANES = 2;
#endif
typedef double V __attribute__((vector_size(8 * LANES)));
typedef int64_t Mask __attribute__((vector_size(8 * LANES)));

static inline V load(const double* p) { V v; std::memcpy(&v, p, sizeof v); return v; }
static inline void store(double* p, V v) { std::memcpy(p, &v, sizeof v); }
static inline V root(V a) { for (int i = 0; i < LANES; i++) a[i] = std::sqrt(a[i]); return a; }
static inline V nearest(V a) { const double big = 6755399441055744.0; return (a + big) - big; }

static inline void cos_sin(V a, V& c, V& s) {  // the series of fdlibm, as in kinetostat.engine.trigonometry
    V q = nearest(a * 0.6366197723675814);
    V r = a - q * 0x1.921fb544p+0 - q * 0x1.0b4611a6p-34 - q * 0x1.3198a2e037073p-69;
    V z = r * r;
    V ps = -1.66666666666666324348e-01 + z * (8.33333333332248946124e-03 + z * (-1.98412698298579493134e-04
        + z * (2.75573137070700676789e-06 + z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10))));
    V pc = 4.16666666666666019037e-02 + z * (-1.38888888888741095749e-03 + z * (2.48015872894767294178e-05
        + z * (-2.75573143513906633035e-07 + z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11))));
    V sine = r + r * z * ps, cosine = 1.0 - 0.5 * z + z * z * pc;
    V turn = q - 4.0 * nearest(0.25 * q), size = turn * turn;
    Mask odd = (size > 0.5) & (size < 1.5);
    V sign = odd ? turn : 1.0 - 0.5 * turn * turn;
    c = sign * (odd ? -sine : cosine);
    s = sign * (odd ? cosine : sine);
}

struct Machine { double base_x[4], base_y[4], top_x[4], top_y[4], first, second, actuator[4], bending[2]; };

// Wrenches [mx my mz fx fy fz] of the four legs and of the two springs (dual to their twists): eq. 32.
struct Pose { V leg[4][6], spring[2][6], c, s, p[2], q[2]; Mask reached; };

static inline void place(const Machine& m, V x, V z, V theta5, V theta6, Pose& o) {
    V c5, s5, c6, s6;
    cos_sin(theta5, c5, s5);
    cos_sin(theta6, c6, s6);
    V square = x * x + z * z, shrink = 1.0 / square;
    V along = 0.5 * (1.0 + (m.first * m.first - m.second * m.second) * shrink);
    V across = root(m.first * m.first * shrink - along * along);
    V ex = x * along + z * across, ez = z * along - x * across;
    V ux = (x - ex) * (1.0 / m.second), uz = (z - ez) * (1.0 / m.second);
    V lx = ex * (1.0 / m.first), lz = ez * (1.0 / m.first);
    V c = uz * c5 + ux * s5, s = ux * c5 - uz * s5, zero = x - x;
    double longest = m.first + m.second, shortest = m.first - m.second;
    o.reached = (square <= longest * longest) & (square >= shortest * shortest);
    o.c = c;
    o.s = s;
    for (int i = 0; i < 4; i++) {
        V rx = c * m.top_x[i] + s * s6 * m.top_y[i], ry = c6 * m.top_y[i], rz = c * s6 * m.top_y[i] - s * m.top_x[i];
        V vx = rx + x - m.base_x[i], vy = ry - m.base_y[i], vz = rz + z;
        V unit = 1.0 / root(vx * vx + vy * vy + vz * vz);
        vx *= unit; vy *= unit; vz *= unit;
        V* w = o.leg[i];
        w[0] = ry * vz - rz * vy; w[1] = rz * vx - rx * vz; w[2] = rx * vy - ry * vx;
        w[3] = vx; w[4] = vy; w[5] = vz;
    }
    o.p[0] = lx * x + lz * z;  // lateral motion of P and turn about (s, 0, c) per unit of each spring
    o.q[0] = lx * c - lz * s;
    o.p[1] = ux * (x - ex) + uz * (z - ez);
    o.q[1] = ux * c - uz * s;
    V inverse = 1.0 / (o.p[0] * o.q[1] - o.p[1] * o.q[0]);
    for (int j = 0; j < 2; j++) {
        V lateral = (j ? -o.q[0] : o.q[1]) * inverse, moment = (j ? o.p[0] : -o.p[1]) * inverse;
        V* w = o.spring[j];
        w[0] = moment * s; w[1] = zero; w[2] = moment * c; w[3] = zero; w[4] = lateral; w[5] = zero;
    }
}

static inline void stiffness_diagonal(const Machine& m, const Pose& o, V* K) {
    for (int i = 0; i < 6; i++) {
        K[i] = m.actuator[0] * o.leg[0][i] * o.leg[0][i];
        for (int k = 1; k < 4; k++) K[i] += m.actuator[k] * o.leg[k][i] * o.leg[k][i];
        if (i != 1 && i != 3 && i != 5)
            for (int j = 0; j < 2; j++) K[i] += m.bending[j] * o.spring[j][i] * o.spring[j][i];
    }
}

// C = K^-1 by Cholesky, unrolled by the compiler.
static inline V compliance_cholesky(const Machine& m, const Pose& o, V* C) {
    V L[6][6], unit[6], smallest = load(reinterpret_cast<const double*>(&o.c)) * 0.0 + 1e300;
    for (int i = 0; i < 6; i++)
        for (int j = 0; j <= i; j++) {
            V sum = m.actuator[0] * o.leg[0][i] * o.leg[0][j];
            for (int k = 1; k < 4; k++) sum += m.actuator[k] * o.leg[k][i] * o.leg[k][j];
            bool spring = i != 1 && i != 3 && i != 5 && j != 1 && j != 3;
            for (int k = 0; k < 2 && spring; k++) sum += m.bending[k] * o.spring[k][i] * o.spring[k][j];
            for (int k = 0; k < j; k++) sum -= L[i][k] * L[j][k];
            if (i == j) smallest = sum < smallest ? sum : smallest, unit[i] = 1.0 / root(sum);
            else L[i][j] = sum * unit[j];
        }
    for (int j = 0; j < 6; j++) {
        V column[6];
        C[j] = smallest * 0.0;
        for (int i = j; i < 6; i++) {
            V sum = i == j ? C[j] + 1.0 : C[j] * 0.0;
            if (i != j) { sum = -L[i][j] * column[j]; for (int k = j + 1; k < i; k++) sum -= L[i][k] * column[k]; }
            column[i] = sum * unit[i];
        }
        for (int i = j; i < 6; i++) C[j] += column[i] * column[i];
    }
    return smallest;
}

// C from the 4x4 system that is left once the passive leg's two wrenches are taken out by hand.
static inline V compliance_reduced(const Machine& m, const Pose& o, V* C) {
    V a[4][4], g[4], N[4][4];
    for (int i = 0; i < 4; i++) {
        const V* w = o.leg[i];
        a[i][0] = w[1]; a[i][1] = w[0] * o.c - w[2] * o.s; a[i][2] = w[3]; a[i][3] = w[5];
        g[i] = w[0] * o.s + w[2] * o.c;
    }
    auto minor = [&](int r, int i, int j) { return a[r][i] * a[r + 1][j] - a[r][j] * a[r + 1][i]; };
    V s0 = minor(0, 0, 1), s1 = minor(0, 0, 2), s2 = minor(0, 0, 3), s3 = minor(0, 1, 2), s4 = minor(0, 1, 3),
      s5 = minor(0, 2, 3), d0 = minor(2, 0, 1), d1 = minor(2, 0, 2), d2 = minor(2, 0, 3), d3 = minor(2, 1, 2),
      d4 = minor(2, 1, 3), d5 = minor(2, 2, 3);
    V determinant = s0 * d5 - s1 * d4 + s2 * d3 + s3 * d2 - s4 * d1 + s5 * d0, inverse = 1.0 / determinant;
    for (int i = 0; i < 4; i++) {
        const V* b = a[i ^ 1];  // row i of the inverse's columns uses the other row of its pair
        V e0 = i < 2 ? d0 : s0, e1 = i < 2 ? d1 : s1, e2 = i < 2 ? d2 : s2, e3 = i < 2 ? d3 : s3, e4 = i < 2 ? d4 : s4,
          e5 = i < 2 ? d5 : s5;
        V sign = i & 1 ? -inverse : inverse;
        N[0][i] = sign * (b[1] * e5 - b[2] * e4 + b[3] * e3);
        N[1][i] = -sign * (b[0] * e5 - b[2] * e2 + b[3] * e1);
        N[2][i] = sign * (b[0] * e4 - b[1] * e2 + b[3] * e0);
        N[3][i] = -sign * (b[0] * e3 - b[1] * e1 + b[2] * e0);
    }
    for (int i = 0; i < 6; i++) C[i] = determinant * 0.0;
    auto add = [&](double weight, const V* y, V turn, V lateral) {
        V rx = o.c * y[1] + o.s * turn, rz = o.c * turn - o.s * y[1];
        C[0] += weight * rx * rx; C[1] += weight * y[0] * y[0]; C[2] += weight * rz * rz;
        C[3] += weight * y[2] * y[2]; C[4] += weight * lateral * lateral; C[5] += weight * y[3] * y[3];
    };
    V none = determinant * 0.0;
    for (int i = 0; i < 4; i++) {
        V y[4] = {N[0][i], N[1][i], N[2][i], N[3][i]};
        add(1.0 / m.actuator[i], y, none, none);
    }
    for (int j = 0; j < 2; j++) {
        V y[4];
        for (int k = 0; k < 4; k++) {
            y[k] = none;
            for (int i = 0; i < 4; i++) y[k] -= N[k][i] * (g[i] * o.q[j] + o.leg[i][4] * o.p[j]);
        }
        add(1.0 / m.bending[j], y, o.q[j], o.p[j]);
    }
    return determinant < 0.0 ? -determinant : determinant;
}

// C = K^-1 by Cholesky from the lower triangle of K; returns the smallest pivot.
static inline V inverse_diagonal(V K[6][6], V* C) {
    V unit[6], none = K[0][0] * 0.0, smallest = none + 1e300;
    for (int j = 0; j < 6; j++)
        for (int i = j; i < 6; i++) {
            V sum = K[i][j];
            for (int k = 0; k < j; k++) sum -= K[i][k] * K[j][k];
            if (i == j) smallest = sum < smallest ? sum : smallest, unit[j] = 1.0 / root(sum);
            else K[i][j] = sum * unit[j];
        }
    for (int j = 0; j < 6; j++) {
        V column[6];
        column[j] = unit[j];
        C[j] = column[j] * column[j];
        for (int i = j + 1; i < 6; i++) {
            V sum = none;
            for (int k = j; k < i; k++) sum -= K[i][k] * column[k];
            column[i] = sum * unit[i];
            C[j] += column[i] * column[i];
        }
    }
    return smallest;
}

// Limits: squares of the shortest and the longest leg, and of the least cosines of a leg to z of base and platform.
struct Hexapod { double base[3][6], top[3][6], actuator[6], shortest, longest, base_cosine, top_cosine, length, margin; };

// Columns x y z roll pitch yaw.
template <bool JUDGED>
static inline V hexapod(const Hexapod& m, const double* const* in, int64_t at, V* C, V* D, Mask& allowed) {
    V p[3], c[3], s[3], K[6][6];
    for (int i = 0; i < 3; i++) p[i] = load(in[i] + at), cos_sin(load(in[3 + i] + at), c[i], s[i]);
    V R[3][3] = {{c[2] * c[1], c[2] * s[1] * s[0] - s[2] * c[0], c[2] * s[1] * c[0] + s[2] * s[0]},
                 {s[2] * c[1], s[2] * s[1] * s[0] + c[2] * c[0], s[2] * s[1] * c[0] - c[2] * s[0]},
                 {-s[1], c[1] * s[0], c[1] * c[0]}};
    for (int i = 0; i < 6; i++)
        for (int j = 0; j <= i; j++) K[i][j] = p[0] * 0.0;
    for (int leg = 0; leg < 6; leg++) {
        V r[3], v[3];
        for (int i = 0; i < 3; i++) {
            r[i] = R[i][0] * m.top[0][leg] + R[i][1] * m.top[1][leg] + R[i][2] * m.top[2][leg];
            v[i] = r[i] + p[i] - m.base[i][leg];
        }
        V square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2], unit = 1.0 / root(square);
        for (int i = 0; i < 3; i++) v[i] *= unit;
        if (JUDGED) {
            V up = v[0] * R[0][2] + v[1] * R[1][2] + v[2] * R[2][2];
            allowed &= (square >= m.shortest) & (square <= m.longest) & (v[2] * v[2] >= m.base_cosine)
                & (up * up >= m.top_cosine);
        }
        V w[6] = {r[1] * v[2] - r[2] * v[1], r[2] * v[0] - r[0] * v[2], r[0] * v[1] - r[1] * v[0], v[0], v[1], v[2]};
        for (int i = 0; i < 6; i++)
            for (int j = 0; j <= i; j++) K[i][j] += m.actuator[leg] * w[i] * w[j];
    }
    for (int i = 0; i < 6; i++) D[i] = K[i][i];
    V smallest = inverse_diagonal(K, C);
    if (!JUDGED) return smallest;
    double area = m.length * m.length;
    V stiff = (D[0] + D[1] + D[2]) * (1.0 / area) + D[3] + D[4] + D[5], soft = (C[0] + C[1] + C[2]) * area + C[3] + C[4] + C[5];
    V margin = 6.0 / root(stiff * soft);
    return (smallest > 1e-9) & (margin > m.margin) ? margin : smallest * 0.0;
}

struct Tripteron { double link, torsion, bending, shear, actuator; };  // compliances of a link; N/m

// Columns x y z. G of a leg for moments across its slide (a, b) and a force along it; P at (u, v) in its plane.
static inline void tripteron_leg(const Tripteron& m, V u, V v, V G[3][3]) {
    V square = u * u + v * v, across = root(m.link * m.link / square - 0.25), none = u * 0.0;
    V eu = 0.5 * u + across * v, ev = 0.5 * v - across * u;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) G[i][j] = none;
    G[2][2] = none + 1.0 / m.actuator;
    for (int k = 0; k < 2; k++) {
        V from_u = k ? eu : none, from_v = k ? ev : none, to_u = k ? u : eu, to_v = k ? v : ev;
        V du = (to_u - from_u) * (1.0 / m.link), dv = (to_v - from_v) * (1.0 / m.link);
        V lever_u = v - 0.5 * (from_v + to_v), lever_v = 0.5 * (from_u + to_u) - u;
        V axes[2][2] = {{du, dv}, {-dv, du}};
        for (int n = 0; n < 2; n++) {
            V load[3] = {axes[n][0], axes[n][1], axes[n][0] * lever_u + axes[n][1] * lever_v};
            double soft = n ? m.bending : m.torsion;
            for (int i = 0; i < 3; i++)
                for (int j = 0; j <= i; j++) G[i][j] += soft * load[i] * load[j];
        }
        G[2][2] += m.shear;
    }
}

static inline V tripteron(const Tripteron& m, const double* const* in, int64_t at, V* C, V* D) {
    V x = load(in[0] + at), y = load(in[1] + at), z = load(in[2] + at), K[6][6];
    for (int i = 0; i < 6; i++)
        for (int j = 0; j <= i; j++) K[i][j] = x * 0.0;
    // axes x, y, z of each leg are base axes with a sign: which, and coordinates of P from where the leg starts
    const int axis[3][3] = {{0, 1, 2}, {0, 2, 1}, {2, 1, 0}};
    const double sign[3][3] = {{1, 1, 1}, {1, -1, 1}, {1, -1, 1}};
    V plane[3][2] = {{x, y}, {x, 1.0 - z}, {z, 1.0 - y}};
    for (int leg = 0; leg < 3; leg++) {
        V G[3][3];
        tripteron_leg(m, plane[leg][0], plane[leg][1], G);
        V a = G[1][1] * G[2][2] - G[2][1] * G[2][1], b = G[2][0] * G[2][1] - G[1][0] * G[2][2];
        V c = G[1][0] * G[2][1] - G[2][0] * G[1][1], shrink = 1.0 / (G[0][0] * a + G[1][0] * b + G[2][0] * c);
        V I[3][3];
        I[0][0] = a * shrink; I[1][0] = b * shrink; I[2][0] = c * shrink;
        I[1][1] = (G[0][0] * G[2][2] - G[2][0] * G[2][0]) * shrink;
        I[2][1] = (G[1][0] * G[2][0] - G[0][0] * G[2][1]) * shrink;
        I[2][2] = (G[0][0] * G[1][1] - G[1][0] * G[1][0]) * shrink;
        int row[3] = {axis[leg][0], axis[leg][1], 3 + axis[leg][2]};
        for (int i = 0; i < 3; i++)
            for (int j = 0; j <= i; j++) {
                int r = row[i] > row[j] ? row[i] : row[j], q = row[i] > row[j] ? row[j] : row[i];
                K[r][q] += sign[leg][i] * sign[leg][j] * I[i][j];
            }
    }
    for (int i = 0; i < 6; i++) D[i] = K[i][i];
    return inverse_diagonal(K, C);
}

static inline V pose_4dof(const Machine& m, const double* const* in, int64_t at, bool reduced, bool all, V* C, V* D,
                          Mask& reached) {
    Pose pose;
    place(m, load(in[0] + at), load(in[1] + at), load(in[2] + at), load(in[3] + at), pose);
    V regular = reduced ? compliance_reduced(m, pose, C) : compliance_cholesky(m, pose, C);
    if (all) stiffness_diagonal(m, pose, D);
    reached = pose.reached;
    return regular;
}

enum Kind { FOUR_DOF, FOUR_DOF_REDUCED, HEXAPOD, TRIPTERON, HEXAPOD_JUDGED };

template <Kind KIND, bool ALL>
static void run(const void* m, const double* const* in, double* const* out, int8_t* status, int64_t count) {
    for (int64_t k = 0; k < count; k += LANES) {
        int64_t at = k <= count - LANES ? k : count - LANES;
        V C[6], K[6], regular;
        Mask reached = Mask{} - 1, allowed = Mask{} - 1;
        if (KIND == HEXAPOD) regular = hexapod<false>(*static_cast<const Hexapod*>(m), in, at, C, K, allowed);
        else if (KIND == HEXAPOD_JUDGED) regular = hexapod<true>(*static_cast<const Hexapod*>(m), in, at, C, K, allowed);
        else if (KIND == TRIPTERON) regular = tripteron(*static_cast<const Tripteron*>(m), in, at, C, K);
        else regular = pose_4dof(*static_cast<const Machine*>(m), in, at, KIND == FOUR_DOF_REDUCED, ALL, C, K, reached);
        Mask solvable = regular > (KIND == HEXAPOD_JUDGED ? 0.0 : 1e-9), ok = reached & solvable & allowed;
        V nan = regular * 0.0 + NAN;
        if (ALL)
            for (int i = 0; i < 6; i++) store(out[i] + at, ok ? C[i] : nan), store(out[6 + i] + at, ok ? K[i] : nan);
        else store(out[0] + at, ok ? C[0] + C[1] + C[2] + C[3] + C[4] + C[5] : nan);
        Mask code = reached ? (solvable ? (allowed ? Mask{} : Mask{} + 2) : Mask{} + 3) : Mask{} + 1;
        for (int i = 0; i < LANES; i++) status[at + i] = int8_t(code[i]);
    }
}

template <Kind KIND>
static void either(const void* m, const double* const* in, double* const* out, int8_t* status, int64_t count, int all) {
    all ? run<KIND, true>(m, in, out, status, count) : run<KIND, false>(m, in, out, status, count);
}

extern "C" void kernel(int kind, const void* m, const double* const* in, double* const* out, int8_t* status,
                       int64_t count, int all) {
    switch (kind) {
        case FOUR_DOF: either<FOUR_DOF>(m, in, out, status, count, all); break;
        case FOUR_DOF_REDUCED: either<FOUR_DOF_REDUCED>(m, in, out, status, count, all); break;
        case HEXAPOD: either<HEXAPOD>(m, in, out, status, count, all); break;
        case HEXAPOD_JUDGED: either<HEXAPOD_JUDGED>(m, in, out, status, count, all); break;
        case TRIPTERON: either<TRIPTERON>(m, in, out, status, count, all); break;
    }
}
