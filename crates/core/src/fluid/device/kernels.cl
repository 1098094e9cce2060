// The sweep of the fluid on a device, to the bits of `sweep_row`: OpenCL C 1.2 with 64-bit atomics and double precision; CUDA C++ after
// `crate::device`'s `cuda.h`.
//
// Built with REAL (float or double: what is computed with), F16 (stored as binary16 of 2^15 g), PAIRS (populations relax in pairs), REGULARISED
// (cells without solids by the recursive regularised collision), BY_VOLUME
// (0: homogenised cells; 1: partially saturated ones, with SC1, SC2 or SC3, their operator, and MOMENTUM, what it gives to a wholly solid
// cell), the numbers of the rules of links, and WARPS where 32 consecutive items add up by instructions of NVIDIA's. Products and sums are never contracted; `fma` stands where
// the processor's kernels have it. A work-group sweeps a tile of TX x TY x TZ cells. Formulas: `fluid/kernel.rs`, `coupling/saturated.rs`,
// `volume_fraction.rs`, `coupling/homogenised.rs`.

#ifdef __OPENCL_VERSION__
#pragma OPENCL FP_CONTRACT OFF
#pragma OPENCL EXTENSION cl_khr_fp64 : enable
#pragma OPENCL EXTENSION cl_khr_int64_base_atomics : enable
// An array that the items of a work-group share, and the number of items of one.
#define SHARED __local
#define WORK_GROUP(items) __attribute__((reqd_work_group_size(items, 1, 1)))
#define ASM __asm__
#endif

#define Q 19
// A row of a tile is a warp.
#define TX 32
#define TY 4
#define TZ 2
#define TILE (TX * TY * TZ)
#define K(x) ((REAL)(x))

#ifdef F16
typedef half Stored;
#define READ(p, i) vload_half((i), (p))
#define WRITE(p, i, x) vstore_half_rte((x), (i), (p))
#define SCALED(x) ((x) * 32768.0f)
#define UNSCALED(x) ((x) * (1.0f / 32768.0f))
#else
typedef REAL Stored;
#define READ(p, i) ((p)[i])
#define WRITE(p, i, x) ((p)[i] = (x))
#define SCALED(x) (x)
#define UNSCALED(x) (x)
#endif

// Distances from the slot of a cell to those of its populations, and the parameters of a sweep: factors of the even and the odd part,
// acceleration, t = tau - 1/2, tau, and the factor of eddies.
typedef struct {
    ulong of[Q];
} Slots;
typedef struct {
    double of[8];
} Parameters;

// ---- fixed-point sums ----

#define MAGIC 1536.0
long to_fixed(double x) { return as_long(x + MAGIC) - as_long(MAGIC); }

#ifdef WARPS
// What all items of a warp have together; for less than 2^58 in size.
int any_of_warp(int x) {
    int any;
    ASM volatile("{ .reg .pred p; setp.ne.s32 p, %1, 0; vote.sync.any.pred p, p, 0xffffffff; selp.s32 %0, 1, 0, p; }" : "=r"(any) : "r"(x));
    return any;
}

long add_up_warp(long x) {
    int low, high;
    ASM volatile("redux.sync.add.s32 %0, %1, 0xffffffff;" : "=r"(low) : "r"((int)(x & 0x7ffffff)));
    ASM volatile("redux.sync.add.s32 %0, %1, 0xffffffff;" : "=r"(high) : "r"((int)(x >> 27)));
    return ((long)high << 27) + (long)(uint)low;
}
#endif

// ---- collision ----

typedef struct {
    REAL deviation, rho;
    REAL m[3], u[3];
} Moments;

Moments moments_of(const REAL g[Q]) {
    REAL s1 = g[1] + g[2], d1 = g[1] - g[2], s3 = g[3] + g[4], d3 = g[3] - g[4], s5 = g[5] + g[6], d5 = g[5] - g[6];
    REAL s7 = g[7] + g[8], d7 = g[7] - g[8], s9 = g[9] + g[10], d9 = g[9] - g[10];
    REAL s11 = g[11] + g[12], d11 = g[11] - g[12], s13 = g[13] + g[14], d13 = g[13] - g[14];
    REAL s15 = g[15] + g[16], d15 = g[15] - g[16], s17 = g[17] + g[18], d17 = g[17] - g[18];
    Moments c;
    c.deviation = UNSCALED(((g[0] + s1) + (s3 + s5)) + ((s7 + s9) + (s11 + s13)) + (s15 + s17));
    c.rho = K(1.0) + c.deviation;
    REAL over_rho = K(1.0) / c.rho;
    c.m[0] = UNSCALED(d1 + ((d7 + d9) + (d11 + d13)));
    c.m[1] = UNSCALED(d3 + ((d7 - d9) + (d15 + d17)));
    c.m[2] = UNSCALED(d5 + ((d11 - d13) + (d15 - d17)));
    for (int a = 0; a < 3; a++) c.u[a] = c.m[a] * over_rho;
    return c;
}

typedef struct {
    REAL rest, half_even, half_odd;
    REAL base[2], quadratic[6], linear[3];
} Relaxation;

#define PRODUCT(a, b) fma(target[a], target[b], -(ku[a] * c->u[b]))

// Weights of a solid of velocity `v` that reflects populations (sc3), `Reflection` of `fluid/kernel.rs`.
typedef struct {
    REAL b, even, odd;
} Reflection;

Relaxation relaxation_of(const Moments* c, const REAL target[3], REAL k, REAL k_odd, int reflected, const Reflection* solid, const REAL v[3]) {
    Relaxation r;
    REAL rest = k, half_odd = K(0.5) * k_odd;
    REAL deviation = (K(1.0) - k) * c->deviation, scale = K(0.125) * c->rho;
    REAL odd[3], ku[3];
    for (int a = 0; a < 3; a++) odd[a] = fma(-k_odd, c->u[a], target[a]);
    if (reflected) {
        REAL open = K(1.0) - solid->even;
        rest = fma(open, rest, solid->even);
        half_odd = fma(-K(0.5), solid->odd, half_odd);
        deviation = open * deviation;
        scale = open * scale;
        for (int a = 0; a < 3; a++) {
            REAL relative = (target[a] - v[a]) + (c->u[a] - v[a]);
            odd[a] = fma(solid->odd, c->u[a], fma(-solid->b, relative, odd[a]));
        }
    }
    for (int a = 0; a < 3; a++) ku[a] = k * c->u[a];
    REAL twofold = scale + scale;
    REAL xx = scale * PRODUCT(0, 0), yy = scale * PRODUCT(1, 1), zz = scale * PRODUCT(2, 2);
    REAL base = fma(-K(12.0), (xx + yy) + zz, deviation);
    REAL along = K(1.0 / 12.0) * c->rho;
    r.rest = rest;
    r.half_even = K(0.5) * rest;
    r.half_odd = half_odd;
    r.base[0] = SCALED(K(1.0 / 18.0) * base);
    r.base[1] = SCALED(K(1.0 / 36.0) * base);
    r.quadratic[0] = SCALED(xx);
    r.quadratic[1] = SCALED(yy);
    r.quadratic[2] = SCALED(zz);
    r.quadratic[3] = SCALED(twofold * PRODUCT(0, 1));
    r.quadratic[4] = SCALED(twofold * PRODUCT(0, 2));
    r.quadratic[5] = SCALED(twofold * PRODUCT(1, 2));
    for (int a = 0; a < 3; a++) r.linear[a] = SCALED(along * odd[a]);
    return r;
}

// The pair of opposite populations that begins with direction `i`, relaxed.
void pair_of(const Relaxation* r, int i, REAL there, REAL back, REAL* first, REAL* second) {
    REAL axis = r->base[0], diagonal = r->base[1];
    REAL xx = r->quadratic[0], yy = r->quadratic[1], zz = r->quadratic[2];
    REAL xy = r->quadratic[3], xz = r->quadratic[4], yz = r->quadratic[5];
    REAL x = r->linear[0], y = r->linear[1], z = r->linear[2];
    REAL e, o;
    switch (i) {
        case 1: e = axis + (xx + xx); o = x + x; break;
        case 3: e = axis + (yy + yy); o = y + y; break;
        case 5: e = axis + (zz + zz); o = z + z; break;
        case 7: e = (diagonal + (xx + yy)) + xy; o = x + y; break;
        case 9: e = (diagonal + (xx + yy)) - xy; o = x - y; break;
        case 11: e = (diagonal + (xx + zz)) + xz; o = x + z; break;
        case 13: e = (diagonal + (xx + zz)) - xz; o = x - z; break;
        case 15: e = (diagonal + (yy + zz)) + yz; o = y + z; break;
        default: e = (diagonal + (yy + zz)) - yz; o = y - z;
    }
#if PAIRS
    REAL even = fma(r->half_even, there + back, e);
    REAL odd = fma(r->half_odd, there - back, o);
    *first = even + odd;
    *second = even - odd;
#else
    *first = fma(r->rest, there, e + o);
    *second = fma(r->rest, back, e - o);
#endif
}

#if REGULARISED
// `Regularised` of `fluid/regularised.rs`.
typedef struct {
    REAL base[2], quadratic[6], along[3], across[6];
} Regularised;

#define NORMAL(s, one, other, a) fma(-c->m[a], c->u[a], UNSCALED(((s) + (one)) + (other)) - isotropic)
#define SHEAR(plus, minus, a, b) fma(-c->m[a], c->u[b], UNSCALED((plus) - (minus)))

Regularised regularised_of(const REAL g[Q], const Moments* c, const Parameters* p) {
    REAL s7 = g[7] + g[8], s9 = g[9] + g[10], s11 = g[11] + g[12], s13 = g[13] + g[14], s15 = g[15] + g[16], s17 = g[17] + g[18];
    REAL isotropic = K(1.0 / 3.0) * c->deviation;
    REAL pi[6] = {NORMAL(g[1] + g[2], s7 + s9, s11 + s13, 0), NORMAL(g[3] + g[4], s7 + s9, s15 + s17, 1),
                  NORMAL(g[5] + g[6], s11 + s13, s15 + s17, 2), SHEAR(s7, s9, 0, 1), SHEAR(s11, s13, 0, 2), SHEAR(s15, s17, 1, 2)};
    REAL k = K(p->of[0]), eddies = K(p->of[7]);
    if (eddies > K(0.0)) {
        REAL diagonal = fma(pi[0], pi[0], fma(pi[1], pi[1], pi[2] * pi[2]));
        REAL size = sqrt(fma(K(2.0), fma(pi[3], pi[3], fma(pi[4], pi[4], pi[5] * pi[5])), diagonal));
        REAL tau = K(p->of[6]), root = eddies * (size * (K(1.0) / c->rho));
        REAL all = K(0.5) * (tau + sqrt(fma(tau, tau, root)));
        k = K(1.0) - K(1.0) / all;
    }
    REAL t[3], q[3], normal[3];
    for (int a = 0; a < 6; a++) pi[a] = k * pi[a];
    for (int a = 0; a < 3; a++) {
        t[a] = c->u[a] + K(p->of[2 + a]);
        q[a] = c->rho * t[a];
        normal[a] = fma(q[a], t[a], pi[a]);
    }
    Regularised r;
    for (int a = 0; a < 3; a++) {
        REAL linear = K(1.0 / 12.0) * q[a], third[2];
        for (int n = 0; n < 2; n++) {
            // The other axes in ascending order; of the shears that of `a` and `b`.
            int b = n + (n >= a);
            third[n] = fma(t[a], normal[b], (t[b] + t[b]) * pi[2 + a + b]);
            r.across[2 * a + n] = SCALED(fma(K(0.25), third[n], linear));
        }
        r.along[a] = SCALED(fma(-K(0.5), third[0] + third[1], linear + linear));
    }
    REAL xx = K(0.125) * normal[0], yy = K(0.125) * normal[1], zz = K(0.125) * normal[2];
    REAL base = fma(-K(12.0), (xx + yy) + zz, c->deviation);
    r.base[0] = SCALED(K(1.0 / 18.0) * base);
    r.base[1] = SCALED(K(1.0 / 36.0) * base);
    r.quadratic[0] = SCALED(xx);
    r.quadratic[1] = SCALED(yy);
    r.quadratic[2] = SCALED(zz);
    r.quadratic[3] = SCALED(K(0.25) * fma(q[0], t[1], pi[3]));
    r.quadratic[4] = SCALED(K(0.25) * fma(q[0], t[2], pi[4]));
    r.quadratic[5] = SCALED(K(0.25) * fma(q[1], t[2], pi[5]));
    return r;
}

void regularised_pair(const Regularised* r, int i, REAL* first, REAL* second) {
    REAL axis = r->base[0], diagonal = r->base[1];
    REAL xx = r->quadratic[0], yy = r->quadratic[1], zz = r->quadratic[2];
    REAL xy = r->quadratic[3], xz = r->quadratic[4], yz = r->quadratic[5];
    const REAL* across = r->across;
    REAL e, o;
    switch (i) {
        case 1: e = axis + (xx + xx); o = r->along[0]; break;
        case 3: e = axis + (yy + yy); o = r->along[1]; break;
        case 5: e = axis + (zz + zz); o = r->along[2]; break;
        case 7: e = (diagonal + (xx + yy)) + xy; o = across[0] + across[2]; break;
        case 9: e = (diagonal + (xx + yy)) - xy; o = across[0] - across[2]; break;
        case 11: e = (diagonal + (xx + zz)) + xz; o = across[1] + across[4]; break;
        case 13: e = (diagonal + (xx + zz)) - xz; o = across[1] - across[4]; break;
        case 15: e = (diagonal + (yy + zz)) + yz; o = across[3] + across[5]; break;
        default: e = (diagonal + (yy + zz)) - yz; o = across[3] - across[5];
    }
    *first = e + o;
    *second = e - o;
}
#endif

// Volume fractions of partially saturated cells.

#define LEAST 1e-4f
#define NEAR 1e-3f
#define HALF_DIAGONAL 0.8660254037844386
#define FAR 1e9
#define ROUND 6755399441055744.0

typedef struct {
    float m1, m2, m3, square, half_all, half_both, both, product, divisor;
} Normal;

float larger(float a, float b) { return a > b ? a : b; }
float smaller(float a, float b) { return a < b ? a : b; }
float at_least(float x, float least) { return larger(fabs(x), least); }

Normal normal_of(float a, float b, float c) {
    Normal n;
    float low = smaller(a, b), high = larger(a, b);
    float rest = larger(low, c);
    n.m1 = smaller(low, c);
    n.m3 = larger(high, c);
    n.m2 = smaller(high, rest);
    n.both = n.m1 + n.m2;
    n.product = 6.0f * (n.m1 * n.m2);
    n.square = n.m1 * n.m1;
    n.half_all = 0.5f * (n.both + n.m3);
    n.half_both = 0.5f * n.both;
    n.divisor = n.product * n.m3;
    return n;
}

float cubed(float x) {
    x = larger(x, 0.0f);
    return (x * x) * x;
}

float behind(const Normal* n, float d) {
    float q = larger(n->half_all - fabs(d), 0.0f);
    float corner = n->m1 * ((3.0f * q) * (q - n->m1) + n->square) - ((cubed(n->m1 - q) + cubed(q - n->m2)) + cubed(q - n->m3));
    float band = n->product * (q - n->half_both);
    float part = (n->both > q ? corner : band) / n->divisor;
    part = smaller(larger(part, 0.0f), 0.5f);
    return d > 0.0f ? part : 1.0f - part;
}

float behind_both(float v, float w, float c) {
    float both = v * w;
    float other = c > 0.0f ? smaller(v, w) : larger(v + w - 1.0f, 0.0f);
    return both + fabs(c) * (other - both);
}

float beyond_edge(float a, float b, float cosine) {
    float over = smaller(a - cosine * b, b - cosine * a);
    return smaller(over, (a * a + b * b) - (2.0f * cosine) * (a * b) - 0.75f * (1.0f - cosine * cosine));
}

// An image of a body: 20 integers and 12 numbers. Kinds: a sphere, flat faces, cells found by the host.
#define INTS 20
#define KIND 0
#define BODY 1
#define X_LOW 2
#define X_HIGH 3
#define Y_LOW 4
#define Y_HIGH 5
#define Z_LOW 6
#define Z_HIGH 7
#define X_BASE 8
#define Y_BASE 9
#define Z_BASE 10
#define FIRST_ROW 11
#define FIRST_FACE 12
#define FACES 13
#define FIRST_MAPPED 14
#define NUMBERS 12
#define CENTRE 0
#define VELOCITY 3
#define ANGULAR 6
#define RADIUS 9
#define DEPTH 10
#define SPHERE 0
#define FLAT 1

// A row of an image: first and last cell, first wholly solid one and the one past the last of those, index of its fractions.
#define SPAN 5
// A face in double precision: normal in y and z, offset, slope, reach; and in single: normal, offset, reach, and a `Normal`.
#define PLANE 5
#define FACE 14

int first_within(double low, double centre) {
    low = low + centre;
    double above = low + ROUND;
    return (int)as_long(low > above - ROUND ? above + 1.0 : above);
}

int last_within(double high, double centre) {
    high = high + centre;
    double below = high + ROUND;
    return (int)as_long(below - ROUND > high ? below - 1.0 : below);
}

// Item (row, image), with the `most` rows that an image has: the cells of the row that may be covered, and what its fractions and velocities
// need.
__kernel void spans(const int count, const int most, __global const int* images, __global const double* numbers, __global const double* planes, __global const int* mapped,
                    __global int* spans, __global float* lengths, __global REAL* velocities) {
    size_t index = get_global_id(0) / most;
    if (index >= (size_t)count) return;
    __global const int* image = images + INTS * index;
    __global const double* n = numbers + NUMBERS * index;
    int rows_y = image[Y_HIGH] - image[Y_LOW] + 1, rows_z = image[Z_HIGH] - image[Z_LOW] + 1;
    int at = (int)(get_global_id(0) % most);
    if (at >= rows_y * rows_z) return;
    int ny = image[Y_LOW] + at % rows_y, nz = image[Z_LOW] + at / rows_y;
    double y = (double)ny - n[CENTRE + 1], z = (double)nz - n[CENTRE + 2];
    size_t row = (size_t)image[FIRST_ROW] + at;
    __global int* span = spans + SPAN * row;
    __global float* of_row = lengths + 3 * row;
    of_row[1] = (float)y;
    of_row[2] = (float)z;

    if (image[KIND] == SPHERE || image[KIND] == FLAT) {
        double outer_low, outer_high, inner_low, inner_high;
        if (image[KIND] == SPHERE) {
            double outer = n[RADIUS] + HALF_DIAGONAL, inner = n[RADIUS] - HALF_DIAGONAL;
            double room = inner > 0.0 ? inner * inner : -1.0;
            double square = (outer * outer - z * z) - y * y;
            outer_high = 0.0 > square ? -1.0 : sqrt(square > 0.0 ? square : 0.0);
            square = (room - z * z) - y * y;
            inner_high = 0.0 > square ? -1.0 : sqrt(square > 0.0 ? square : 0.0);
            outer_low = 0.0 - outer_high;
            inner_low = 0.0 - inner_high;
            of_row[0] = (float)(y * y + z * z);
        } else {
            outer_low = inner_low = -FAR;
            outer_high = inner_high = FAR;
            for (int f = 0; f < image[FACES]; f++) {
                __global const double* plane = planes + PLANE * ((size_t)image[FIRST_FACE] + f);
                double slope = plane[3], reach = plane[4];
                double rest = (plane[2] - plane[1] * z) - plane[0] * y;
                double x = rest * slope, more = reach * slope;
                if (slope > 0.0) {
                    outer_high = outer_high < x + more ? outer_high : x + more;
                    inner_high = inner_high < x - more ? inner_high : x - more;
                } else if (slope < 0.0) {
                    outer_low = outer_low > x + more ? outer_low : x + more;
                    inner_low = inner_low > x - more ? inner_low : x - more;
                } else {
                    outer_high = rest > -reach ? outer_high : -FAR;
                    inner_high = reach > rest ? -FAR : inner_high;
                }
            }
            outer_low = outer_low < FAR ? outer_low : FAR;
            outer_high = outer_high > -FAR ? outer_high : -FAR;
            inner_low = inner_low < FAR ? inner_low : FAR;
            inner_high = inner_high > -FAR ? inner_high : -FAR;
        }
        int first = first_within(outer_low, n[CENTRE]), last = last_within(outer_high, n[CENTRE]);
        int begin = first_within(inner_low, n[CENTRE]), end = last_within(inner_high, n[CENTRE]);
        first = max(first, image[X_LOW]);
        last = min(last, image[X_HIGH]);
        begin = max(begin, first);
        end = min(end, last) + 1;
        span[0] = first;
        span[1] = last;
        span[2] = begin < end ? begin : last + 1;
        span[3] = begin < end ? end : last + 1;
        span[4] = 0;
    } else {
        for (int k = 0; k < SPAN; k++) span[k] = mapped[SPAN * ((size_t)image[FIRST_MAPPED] + at) + k];
    }

    __global REAL* velocity = velocities + 6 * row;
    double w0 = n[ANGULAR], w1 = n[ANGULAR + 1], w2 = n[ANGULAR + 2];
    velocity[0] = (REAL)(n[VELOCITY] + (w1 * z - w2 * y));
    velocity[1] = (REAL)(n[VELOCITY + 1] - w0 * z);
    velocity[2] = (REAL)(n[VELOCITY + 2] + w0 * y);
    velocity[3] = (REAL)w2;
    velocity[4] = (REAL)-w1;
    velocity[5] = (REAL)n[CENTRE];
}

// Row of an image in which the cell lies, or -1.
long row_of(__global const int* image, int y, int z) {
    int ny = y - image[Y_BASE], nz = z - image[Z_BASE];
    if (ny < image[Y_LOW] || ny > image[Y_HIGH] || nz < image[Z_LOW] || nz > image[Z_HIGH]) return -1;
    return (long)image[FIRST_ROW] + (long)(nz - image[Z_LOW]) * (image[Y_HIGH] - image[Y_LOW] + 1) + (ny - image[Y_LOW]);
}

// The image may cover cells of the tile that begins at a cell.
int reaches(__global const int* image, int x, int y, int z) {
    int nx = x - image[X_BASE], ny = y - image[Y_BASE], nz = z - image[Z_BASE];
    return nx <= image[X_HIGH] && nx + TX > image[X_LOW] && ny <= image[Y_HIGH] && ny + TY > image[Y_LOW] && nz <= image[Z_HIGH] &&
           nz + TZ > image[Z_LOW];
}

#if !BY_VOLUME
// Velocity of a body in the cell at an offset.
void velocity_of(__global const double* n, int nx, int ny, int nz, double u[3]) {
    double x = (double)nx - n[CENTRE], y = (double)ny - n[CENTRE + 1], z = (double)nz - n[CENTRE + 2];
    double w0 = n[ANGULAR], w1 = n[ANGULAR + 1], w2 = n[ANGULAR + 2];
    u[0] = n[VELOCITY] + (w1 * z - w2 * y);
    u[1] = (n[VELOCITY + 1] - w0 * z) + w2 * x;
    u[2] = (n[VELOCITY + 2] + w0 * y) + -w1 * x;
}
#endif

float height_of(__global const float* face, float x, float y, float z) {
    return face[0] * x - (face[3] - (face[1] * y + face[2] * z));
}

#define MEETING 12
#define LINES 32
#define PARALLEL 1e-20f

// Solid fraction of a cell in which more than MEETING faces meet: that behind the one that cuts off most, less what the others cut off there
// along lines in the direction of the axis nearest to its normal.
float along_lines(__global const float* faces, int count, float x, float y, float z, int deepest) {
    __global const float* most = faces + FACE * (size_t)deepest;
    float nx = fabs(most[0]), ny = fabs(most[1]), nz = fabs(most[2]);
    int axis = ny > nx ? 1 : 0;
    if (nz > (ny > nx ? ny : nx)) axis = 2;
    float low[LINES], high[LINES], length[LINES];
    for (int k = 0; k < LINES; k++) {
        low[k] = -0.5f;
        high[k] = 0.5f;
    }
    for (int f = -1; f < count; f++) {
        __global const float* face = f < 0 ? most : faces + FACE * (size_t)f;
        float height = height_of(face, x, y, z);
        if (height > -face[4]) {
            float along = face[axis], b = face[(axis + 1) % 3], d = face[(axis + 2) % 3];
            if (fabs(along) < PARALLEL) along = PARALLEL;
            float over = -1.0f / along;
            for (int k = 0; k < LINES; k++) {
                float u = ((float)k + 0.5f) * (1.0f / LINES) - 0.5f, v = ((float)(7 * k % LINES) + 0.5f) * (1.0f / LINES) - 0.5f;
                float end = (height + (b * u + d * v)) * over;
                if (along > 0.0f) {
                    high[k] = high[k] < end ? high[k] : end;
                } else {
                    low[k] = low[k] > end ? low[k] : end;
                }
            }
        }
        if (f < 0) {
            for (int k = 0; k < LINES; k++) {
                float left = high[k] - low[k];
                length[k] = left > 0.0f ? left : 0.0f;
            }
        }
    }
    float cut = 0.0f;
    for (int k = 0; k < LINES; k++) {
        float left = high[k] - low[k];
        cut += length[k] - (left > 0.0f ? left : 0.0f);
    }
    Normal normal = {most[5], most[6], most[7], most[8], most[9], most[10], most[11], most[12], most[13]};
    float fraction = behind(&normal, height_of(most, x, y, z)) - cut * (1.0f / LINES);
    return fraction > 0.0f ? fraction : 0.0f;
}

// Solid fraction of the cell with the offset `n` in a row.
float fraction_of(__global const int* image, __global const double* numbers, __global const float* faces, __global const float* cut,
                  __global const int* span, __global const float* of_row, int n) {
    if (n < span[0] || n > span[1]) return 0.0f;
    if (n >= span[2] && n < span[3]) return 1.0f;
    float x = (float)n - (float)numbers[CENTRE];
    if (image[KIND] == SPHERE) {
        float least = LEAST * (float)numbers[RADIUS];
        float distance = larger(sqrt(x * x + of_row[0]), NEAR);
        Normal normal = normal_of(at_least(x, least), at_least(of_row[1], least), at_least(of_row[2], least));
        return behind(&normal, (distance + (float)numbers[DEPTH]) * distance);
    }
    if (image[KIND] != FLAT) {
        int head = span[2] - span[0];
        return cut[span[4] + (n < span[2] ? n - span[0] : head + (n - span[3]))];
    }
    float fraction = 1.0f, y = of_row[1], z = of_row[2];
    if (image[FACES] > MEETING) {
        __global const float* own = faces + FACE * (size_t)image[FIRST_FACE];
        int meeting = 0, deepest = 0;
        float depth = -1.0f;
        for (int f = 0; f < image[FACES]; f++) {
            float reach = own[FACE * f + 4], height = height_of(own + FACE * f, x, y, z);
            if (height >= reach) return 0.0f;
            meeting += height > -reach;
            if (height + reach > depth) {
                depth = height + reach;
                deepest = f;
            }
        }
        if (meeting > MEETING) return along_lines(own, image[FACES], x, y, z, deepest);
    }
    for (int f = 0; f < image[FACES]; f++) {
        __global const float* face = faces + FACE * ((size_t)image[FIRST_FACE] + f);
        float reach = face[4], height = height_of(face, x, y, z);
        if (height >= reach) return 0.0f;
        if (!(height > -reach)) continue;
        float most_like = -1.0f;
        for (int g = 0; g < f; g++) {
            __global const float* other = faces + FACE * ((size_t)image[FIRST_FACE] + g);
            float above = height_of(other, x, y, z);
            if (above + other[4] > 0.0f && height + reach > 0.0f) {
                float cosine = (face[0] * other[0] + face[1] * other[1]) + face[2] * other[2];
                if (beyond_edge(height, above, cosine) > 0.0f) return 0.0f;
                most_like = cosine > most_like ? cosine : most_like;
            }
        }
        Normal normal = {face[5], face[6], face[7], face[8], face[9], face[10], face[11], face[12], face[13]};
        float part = behind(&normal, height);
        fraction = fraction < 1.0f ? behind_both(fraction, part, most_like) : part;
    }
    return fraction;
}

// ---- the sweep ----

#define LEAK 0.01
#define FILM 20.0
#define OPEN 0.6
#define PLAIN 0.25

// How an operator treats a covered cell: it reflects in the relaxation, or PULLS single populations.
#if !BY_VOLUME
#define REFLECTS 0
#elif defined(SC3)
#define REFLECTS 1
#elif defined(SC1) || defined(SC2)
#define REFLECTS 0
#define PULLS
#else
#error "no kernel for this operator"
#endif

__constant int C[Q][3] = {{0, 0, 0}, {1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}, {1, 1, 0}, {-1, -1, 0}, {1, -1, 0},
                          {-1, 1, 0}, {1, 0, 1}, {-1, 0, -1}, {1, 0, -1}, {-1, 0, 1}, {0, 1, 1}, {0, -1, -1}, {0, 1, -1}, {0, -1, 1}};

#ifdef SC1
REAL along(int i, const REAL v[3]) {
    REAL sum = K(0.0);
    for (int a = 0; a < 3; a++) sum = fma(K(C[i][a]), v[a], sum);
    return sum;
}

// What bounce-back off a moving wall adds to a population (sc1).
REAL bounced(const Moments* c, const REAL v[3], int i) {
    REAL cu = along(i, c->u), cv = along(i, v);
    REAL uu = c->u[0] * c->u[0] + c->u[1] * c->u[1] + c->u[2] * c->u[2], vv = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    REAL quadratic = K(4.5) * (cv * cv - cu * cu) + K(1.5) * (uu - vv);
    REAL weight = i == 0 ? K(1.0 / 3.0) : i < 7 ? K(1.0 / 18.0) : K(1.0 / 36.0);
    return weight * (c->rho * (quadratic + K(3.0) * (cu + cv)));
}
#endif

// Sums of `count` columns over the items of a work-group, into the first item of each column.
void add_up(__local long* columns, int count, int item) {
    barrier(CLK_LOCAL_MEM_FENCE);
    for (int column = item / 16; column < count; column += TILE / 16) {
        __local long* own = columns + TILE * column + item % 16;
        long sum = own[0];
        for (int k = 16; k < TILE; k += 16) sum += own[k];
        own[0] = sum;
    }
    barrier(CLK_LOCAL_MEM_FENCE);
    if (item < count) {
        long sum = 0;
        for (int k = 0; k < 16; k++) sum += columns[TILE * item + k];
        columns[TILE * item] = sum;
    }
    barrier(CLK_LOCAL_MEM_FENCE);
}

#define NO_FAULT 0x7fffffffffffffffL

// Of three columns, the squares of speeds, and cells that are too fast with their speeds, the largest square, and the first of these cells
// with its speed, into the first item of each column: of sixteen items each, then of all.
void fastest(__local long* columns, int item) {
    barrier(CLK_LOCAL_MEM_FENCE);
    for (int count = TILE / 16; count > 0; count /= 16) {
        if (item < count) {
            double most = 0.0;
            long fault = NO_FAULT, speed = 0;
            for (int k = item; k < 16 * count; k += count) {
                double square = as_double(columns[k]);
                if (square > most) most = square;
                if (columns[TILE + k] < fault) {
                    fault = columns[TILE + k];
                    speed = columns[2 * TILE + k];
                }
            }
            columns[item] = as_long(most);
            columns[TILE + item] = fault;
            columns[2 * TILE + item] = speed;
        }
        barrier(CLK_LOCAL_MEM_FENCE);
    }
}

#define WORDS 8
#define LIMIT 0.4

// What a cell gives to a body: force and moment by the offset `n` along the row, now and of what is taken off in the next step.
typedef struct {
    long fx, fy, fz, xy, xz;
} Given;

Given given_of(const double p[3], int n) {
    Given g = {to_fixed(p[0]), to_fixed(p[1]), to_fixed(p[2]), to_fixed((double)n * p[1]), to_fixed((double)n * p[2])};
    return g;
}

// Force and moment of what the cells of a row, at offsets `ny` and `nz`, give.
void words_of(const Given* g, long ny, long nz, long words[6]) {
    words[0] = g->fx;
    words[1] = g->fy;
    words[2] = g->fz;
    words[3] = ny * g->fz - nz * g->fy;
    words[4] = nz * g->fx - g->xz;
    words[5] = g->xy - ny * g->fx;
}

// A work-group for each tile. `sizes`: cells, pitch; `rows` of a plane with ghosts; `box`: cells of the box, first cell of the block;
// `bins`: tiles in a bin and bins along x and y. `walls`, if any: 1 for cells in walls, 2 for those not swept. `bin_images`: images that may
// touch each bin. `received`: of each body, force and moment of what it receives, and of what is taken off in the next step.
__kernel WORK_GROUP(TILE) void sweep(
    __global Stored* g, const Slots slots, const int4 sizes, const int rows, const int4 box, const int4 corner, const int4 bin,
    const int4 bins, const Parameters relaxation, const int has_walls, __global const uchar* walls, __global const uint* bin_start,
    __global const int* bin_images, __global const int* images, __global const double* numbers, __global const float* faces,
    __global const float* cut, __global const int* spans, __global const float* lengths, __global const REAL* velocities,
    __global long* received, const int measure, __global long* flows) {
#ifdef WARPS
    SHARED long columns[8 * TILE];
#else
    SHARED long columns[12 * TILE];
#endif
    int item = (int)get_local_id(0);
    int tile = (int)get_group_id(0);
    int tiles_x = (sizes.x + TX - 1) / TX, tiles_y = (sizes.y + TY - 1) / TY;
    int x = (tile % tiles_x) * TX + item % TX;
    int y = (tile / tiles_x % tiles_y) * TY + item / TX % TY;
    int z = tile / tiles_x / tiles_y * TZ + item / (TX * TY);
    int is_cell = x < sizes.x && y < sizes.y && z < sizes.z;
    uchar wall = 0;
    if (is_cell && has_walls) wall = walls[((size_t)z * sizes.y + y) * sizes.x + x];
    int is_swept = is_cell && wall != 2;
    int in_bin = (tile / tiles_x / tiles_y / bin.z * bins.y + tile / tiles_x % tiles_y / bin.y) * bins.x + tile % tiles_x / bin.x;
    // Images that reach the tile, in their order; all of the bin where these are more than items.
    SHARED int listed[TILE];
    __global const int* of_bin = bin_images + bin_start[in_bin];
    int count = (int)(bin_start[in_bin + 1] - bin_start[in_bin]), is_listed = count <= TILE;
    if (is_listed && count > 0) {
        int reached = 0, before = 0;
        if (item < count) {
            reached = reaches(images + INTS * of_bin[item], x - item % TX, y - item / TX % TY, z - item / (TX * TY));
            listed[item] = reached;
        }
        barrier(CLK_LOCAL_MEM_FENCE);
        int all = 0;
        for (int k = 0; k < count; k++) {
            before += k < item ? listed[k] : 0;
            all += listed[k];
        }
        barrier(CLK_LOCAL_MEM_FENCE);
        if (reached) listed[before] = of_bin[item];
        barrier(CLK_LOCAL_MEM_FENCE);
        count = all;
    }
    size_t cell = ((size_t)(z + 1) * rows + (y + 1)) * sizes.w + 16 + x;
    REAL f[Q];
    if (is_swept) {
        for (int i = 0; i < Q; i++) f[i] = READ(g, cell + slots.of[i]);
    }

    REAL fraction = K(0.0), total = K(0.0), sum[3], v[3];
    // The last image that has a part of the cell, and whether others have, too.
    int is_covered = 0, owner = -1, is_shared = 0;
    for (int a = 0; a < 3; a++) sum[a] = v[a] = K(0.0);
    if (is_swept && wall == 0) {
        for (int k = 0; k < count; k++) {
            int of = is_listed ? listed[k] : of_bin[k];
            __global const int* image = images + INTS * of;
            long row = row_of(image, y, z);
            if (row < 0) continue;
            int n = x - image[X_BASE];
            __global const int* span = spans + SPAN * row;
            float phi = fraction_of(image, numbers + NUMBERS * of, faces, cut, span, lengths + 3 * row, n);
            // Homogenised cells exchange momentum wherever the host found them, with a fraction of zero as well.
            is_covered |= BY_VOLUME ? phi > 0.0f : n >= span[0] && n <= span[1];
            if (!(phi > 0.0f)) continue;
            __global const REAL* velocity = velocities + 6 * row;
            REAL part = (REAL)phi, from_centre = K(n) - velocity[5];
            REAL u[3] = {velocity[0], velocity[1] + velocity[3] * from_centre, velocity[2] + velocity[4] * from_centre};
            is_shared |= owner >= 0;
            owner = of;
            total = total + part;
            int is_alone = total == part, rests = 1;
            // Bodies that overlap at rest have no film between them.
            for (int a = 0; a < 3; a++) rests = rests && u[a] == K(0.0) && (is_alone || v[a] == K(0.0));
            REAL at_most = rests && total > K(1.0) ? K(1.0) : total;
            fraction = BY_VOLUME || is_alone ? at_most : K(1.0) - (K(1.0) - fraction) * (K(1.0) - part);
            for (int a = 0; a < 3; a++) {
                sum[a] = sum[a] + part * u[a];
                v[a] = is_alone ? u[a] : (REAL)((double)sum[a] / (double)total);
            }
        }
    }

    // What solids receive, and what is taken off in the next step: momentum, and the mass that moves with homogenised cells.
    REAL mean[3], in[4], out[4], solid = K(0.0);
    for (int a = 0; a < 3; a++) mean[a] = in[a] = out[a] = K(0.0);
    in[3] = out[3] = K(0.0);
    if (is_swept) {
        Moments c = moments_of(f);
        REAL k = K(relaxation.of[0]), k_odd = K(relaxation.of[1]), t = K(relaxation.of[5]);
        REAL target[3];
        Reflection reflection = {K(0.0), K(0.0), K(0.0)};
        Relaxation r;
        for (int a = 0; a < 3; a++) mean[a] = BY_VOLUME ? fma(K(0.5), c.rho * K(relaxation.of[2 + a]), c.m[a]) : c.m[a];
        if (is_covered) {
#if BY_VOLUME
            REAL overlap = fraction - K(1.0);
            overlap = overlap > K(0.0) ? overlap : K(0.0);
            solid = fraction - overlap;
            REAL open = K(1.0) - solid;
            REAL through = fma(K(FILM) * t, overlap, fma(K(OPEN), open, K(LEAK)));
            REAL q = K(1.0) - k, s = K(1.0) + k_odd, x = (t * solid) * fma(K(1.0 - PLAIN), solid, K(PLAIN));
            REAL qx = (K(0.5) * q) * x, sx = (K(0.5) * s) * x;
            REAL all = through + x, even = through + qx, odd = through + sx;
            REAL over = K(1.0) / ((all * even) * odd);
            reflection.b = (x * (even * odd)) * over;
            reflection.even = (qx * (all * odd)) * over;
            reflection.odd = (s * (sx * (all * even))) * over;
            REAL given = (reflection.b * c.rho) * K(MOMENTUM);
            for (int a = 0; a < 3; a++) {
                REAL acceleration = K(relaxation.of[2 + a]);
                target[a] = fma(open, acceleration, c.u[a]);
                REAL fed = c.rho * (open * acceleration);
                REAL force = fma(given, c.u[a] - v[a], reflection.b * fed);
                REAL gained = fed - force;
                REAL inside = solid * fma(-c.rho, v[a], c.m[a] + gained);
                REAL midway = fma(K(0.5), gained, c.m[a]);
                mean[a] = midway - solid * (midway - c.rho * v[a]);
                in[a] = force + inside;
                out[a] = inside;
            }
#else
            solid = fraction;
            for (int a = 0; a < 3; a++) {
                REAL driven = c.u[a] + K(relaxation.of[2 + a]);
                target[a] = fma(solid, v[a] - driven, driven);
                in[a] = c.m[a];
                out[a] = c.rho * target[a];
            }
            in[3] = c.deviation - UNSCALED(f[0]);
#endif
            r = relaxation_of(&c, target, k, k_odd, REFLECTS, &reflection, v);
        } else {
            for (int a = 0; a < 3; a++) target[a] = c.u[a] + K(relaxation.of[2 + a]);
            r = relaxation_of(&c, target, k, k_odd, 0, &reflection, v);
        }
        if (wall == 1) {
            for (int i = 0; i < Q; i++) WRITE(g, cell + slots.of[i], K(0.0));
            for (int a = 0; a < 3; a++) mean[a] = K(0.0);
#ifdef PULLS
        } else if (is_covered) {
            // In populations as they are, not as they are stored.
            Relaxation to = relaxation_of(&c, v, k, k_odd, 0, &reflection, v);
            for (int a = 0; a < 2; a++) { r.base[a] = UNSCALED(r.base[a]); to.base[a] = UNSCALED(to.base[a]); }
            for (int a = 0; a < 6; a++) { r.quadratic[a] = UNSCALED(r.quadratic[a]); to.quadratic[a] = UNSCALED(to.quadratic[a]); }
            for (int a = 0; a < 3; a++) { r.linear[a] = UNSCALED(r.linear[a]); to.linear[a] = UNSCALED(to.linear[a]); }
            for (int i = 0; i < Q; i++) f[i] = UNSCALED(f[i]);
            REAL relaxed = fma(r.rest, f[0], K(6.0) * r.base[0]);
#ifdef SC2
            REAL pulled = fma(to.rest, f[0], K(6.0) * to.base[0]);
#else
            REAL pulled = f[0] + bounced(&c, v, 0);
#endif
            WRITE(g, cell + slots.of[0], SCALED(fma(reflection.b, pulled - relaxed, relaxed)));
            for (int i = 1; i < Q; i += 2) {
                REAL there, back, pulled_there, pulled_back;
                pair_of(&r, i, f[i], f[i + 1], &there, &back);
#ifdef SC2
                pair_of(&to, i, f[i], f[i + 1], &pulled_there, &pulled_back);
#else
                pulled_there = f[i + 1] + bounced(&c, v, i);
                pulled_back = f[i] + bounced(&c, v, i + 1);
#endif
                WRITE(g, cell + slots.of[i + 1], SCALED(fma(reflection.b, pulled_there - there, there)));
                WRITE(g, cell + slots.of[i], SCALED(fma(reflection.b, pulled_back - back, back)));
            }
#endif
#if REGULARISED
        } else if (!is_covered) {
            Regularised open = regularised_of(f, &c, &relaxation);
            WRITE(g, cell + slots.of[0], K(6.0) * open.base[0]);
            for (int i = 1; i < Q; i += 2) {
                REAL there, back;
                regularised_pair(&open, i, &there, &back);
                WRITE(g, cell + slots.of[i + 1], there);
                WRITE(g, cell + slots.of[i], back);
            }
#endif
        } else {
            REAL at_rest = fma(r.rest, f[0], K(6.0) * r.base[0]);
            if (is_covered) out[3] = c.deviation - UNSCALED(at_rest);
            WRITE(g, cell + slots.of[0], at_rest);
            for (int i = 1; i < Q; i += 2) {
                REAL there, back;
                pair_of(&r, i, f[i], f[i + 1], &there, &back);
                WRITE(g, cell + slots.of[i + 1], there);
                WRITE(g, cell + slots.of[i], back);
            }
        }
    }

    // What each body gets of this tile. The loop is the same for all items, or for those of a row, which are a warp.
#ifdef WARPS
    if (!any_of_warp(is_covered)) count = 0;
#endif
    for (int k = 0; k < count; k++) {
        int of = is_listed ? listed[k] : of_bin[k];
        __global const int* image = images + INTS * of;
        long row = row_of(image, y, z);
        int n = x - image[X_BASE];
#if BY_VOLUME
        int is_its = is_covered && owner == of;
        double share = 1.0;
        if (is_covered && is_shared && row >= 0) {
            float phi = fraction_of(image, numbers + NUMBERS * of, faces, cut, spans + SPAN * row, lengths + 3 * row, n);
            is_its = phi > 0.0f;
            share = (double)phi / (double)total;
        }
#else
        // Each body receives by its own velocity.
        int is_its = is_covered && row >= 0 && n >= spans[SPAN * row] && n <= spans[SPAN * row + 1];
        double u[3];
        if (is_its) velocity_of(numbers + NUMBERS * of, n, y - image[Y_BASE], z - image[Z_BASE], u);
#endif
#ifdef WARPS
        if (!any_of_warp(is_its)) continue;
        long word = 0;
#else
        for (int j = 0; j < 12; j++) columns[TILE * j + item] = 0;
#endif
        for (int way = 0; way < 2; way++) {
            Given given = {0, 0, 0, 0, 0};
            if (is_its) {
                double p[3];
                for (int a = 0; a < 3; a++) {
                    p[a] = (double)(way == 0 ? in[a] : out[a]);
#if BY_VOLUME
                    p[a] = share * p[a];
#else
                    p[a] = p[a] - u[a] * (double)(way == 0 ? in[3] : out[3]);
#endif
                }
                given = given_of(p, n);
            }
            long words[6];
#ifdef WARPS
            given.fx = add_up_warp(given.fx);
            given.fy = add_up_warp(given.fy);
            given.fz = add_up_warp(given.fz);
            given.xy = add_up_warp(given.xy);
            given.xz = add_up_warp(given.xz);
            words_of(&given, y - image[Y_BASE], z - image[Z_BASE], words);
            for (int j = 0; j < 6; j++) word = item % TX == 6 * way + j ? words[j] : word;
#else
            if (is_its) {
                words_of(&given, y - image[Y_BASE], z - image[Z_BASE], words);
                for (int j = 0; j < 6; j++) columns[TILE * (6 * way + j) + item] = words[j];
            }
#endif
        }
#ifdef WARPS
        if (item % TX < 12) atom_add(received + 12 * (size_t)image[BODY] + item % TX, word);
#else
        add_up(columns, 12, item);
        if (item < 12 && columns[TILE * item] != 0) atom_add(received + 12 * (size_t)image[BODY] + item, columns[TILE * item]);
        barrier(CLK_LOCAL_MEM_FENCE);
#endif
    }

    if (measure) {
        double p[3] = {(double)mean[0], (double)mean[1], (double)mean[2]};
        double square = p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
        int counts = is_swept && wall == 0;
        if (!counts) square = 0.0;
        for (int a = 0; a < 3; a++) columns[TILE * a + item] = counts ? to_fixed(p[a]) : 0;
        columns[TILE * 3 + item] = counts ? to_fixed(square) : 0;
        columns[TILE * 4 + item] = counts ? to_fixed((double)solid) : 0;
        columns[TILE * 5 + item] = as_long(square);
        int is_fast = !(square < LIMIT * LIMIT) && !(sqrt(square) < LIMIT);
        long key = ((long)(corner.z + z) * box.y + (corner.y + y)) * box.x + (corner.x + x);
        columns[TILE * 6 + item] = is_fast ? key : NO_FAULT;
        columns[TILE * 7 + item] = is_fast ? as_long(sqrt(square)) : 0;
        add_up(columns, 5, item);
        fastest(columns + TILE * 5, item);
        if (item < WORDS) flows[WORDS * (size_t)tile + item] = columns[TILE * item];
    }
}

// Adds up the flows of all tiles: the words `n & 0xffffffffff` and `n >> 40` of each sum, the largest square of a speed, the first cell that
// is too fast, and its speed.
__kernel WORK_GROUP(TILE) void flow_total(__global const long* flows, const int tiles, __global long* total) {
    SHARED long columns[13 * TILE];
    int item = (int)get_local_id(0);
    long words[10];
    for (int j = 0; j < 10; j++) words[j] = 0;
    double most = 0.0;
    long fault = NO_FAULT, speed = 0;
    for (int tile = item; tile < tiles; tile += TILE) {
        __global const long* flow = flows + WORDS * (size_t)tile;
        for (int j = 0; j < 5; j++) {
            words[2 * j] += flow[j] & 0xffffffffffL;
            words[2 * j + 1] += flow[j] >> 40;
        }
        double square = as_double(flow[5]);
        if (square > most) most = square;
        if (flow[6] < fault) {
            fault = flow[6];
            speed = flow[7];
        }
    }
    for (int j = 0; j < 10; j++) columns[TILE * j + item] = words[j];
    columns[TILE * 10 + item] = as_long(most);
    columns[TILE * 11 + item] = fault;
    columns[TILE * 12 + item] = speed;
    add_up(columns, 10, item);
    fastest(columns + TILE * 10, item);
    if (item < 13) total[item] = columns[TILE * item];
}

// ---- links ----

// Copies populations by a rule, with the numbers that it has for each link; exchanges them between two sides.
__kernel void copy_links(__global Stored* g, __global const ulong* to, __global const ulong* from, const ulong count, const int rule,
                         __global const REAL* numbers) {
    size_t k = get_global_id(0);
    if (k >= count) return;
    REAL population = READ(g, from[k]);
    switch (rule) {
        case RESTING: break;
        case MOVING: population = SCALED(UNSCALED(population) + numbers[k]); break;
        case TWO_SIDED: WRITE(g, from[k], READ(g, to[k])); break;
    }
    WRITE(g, to[k], population);
}

// Interpolated links of cells beside walls, of which `first` is the first link: one number, and three for each link. `now`: distances from a
// cell to `f_i` after streaming; `before`: to the `f'_-i` in the same cell.
__kernel void interpolate_links(__global Stored* g, const Slots now, const Slots before, __global const ulong* cells,
                                __global const uint* first, __global const uint* directions, const ulong count,
                                __global const REAL* numbers) {
    size_t k = get_global_id(0);
    if (k >= count) return;
    __global const REAL* n = numbers + k + 3 * (size_t)first[k];
    REAL gained = n[0];
    for (uint l = first[k]; l < first[k + 1]; l++, n += 3) {
        uint i = directions[l], j = i + 2 * (i % 2) - 1;
        REAL sent = UNSCALED(READ(g, cells[k] + before.of[i])), left = UNSCALED(READ(g, cells[k] + before.of[j]));
        REAL arrived = UNSCALED(READ(g, cells[k] + now.of[j]));
        REAL change = n[1] * (arrived - left) + n[2] * (left - sent);
        gained = gained + change;
        WRITE(g, cells[k] + now.of[i], SCALED(sent + (change + n[3])));
    }
    WRITE(g, cells[k], SCALED(UNSCALED(READ(g, cells[k])) - gained));
}

// What cells beside outlets send back: `first` is the first link of each, `left` the distances from a cell to what has left it.
// `rates`: 0 where sound is reflected; else a mean momentum outwards, behind the populations, follows that of the cell.
__kernel void outlets(__global Stored* g, const Slots left, __global const ulong* cells, __global const REAL* excess,
                      __global const REAL* rates, __global const uint* axes, __global const REAL* outwards,
                      __global const ulong* means, __global const uint* first, __global const ulong* from, __global const ulong* to,
                      __global const REAL* weights, const ulong count) {
    size_t k = get_global_id(0);
    if (k >= count) return;
    REAL sum = K(0.0), momentum[3] = {K(0.0), K(0.0), K(0.0)};
    for (int i = 1; i < Q; i++) {
        REAL population = UNSCALED(READ(g, cells[k] + left.of[i]));
        sum = sum + population;
        for (int a = 0; a < 3; a++) momentum[a] = momentum[a] + (REAL)C[i][a] * population;
    }
    REAL square = (momentum[0] * momentum[0] + momentum[1] * momentum[1]) + momentum[2] * momentum[2];
    REAL wanted = excess[k];
    if (rates[k] > K(0.0)) {
        __global REAL* mean = (__global REAL*)(g + means[k]);
        REAL now = outwards[k] * momentum[axes[k]];
        REAL follows = *mean + rates[k] * (now - *mean);
        *mean = follows;
        wanted = excess[k] + K(1.7320508075688772) * (now - follows);
    }
    REAL more = wanted - (K(1.5) * sum - K(0.75) * square);
    for (uint l = first[k]; l < first[k + 1]; l++) {
        WRITE(g, to[l], SCALED(UNSCALED(READ(g, from[l])) + weights[l] * more));
    }
}

// Populations that cross to other blocks, into a message and out of it, from the numbers `at` and `first` of the lists on.
__kernel void pack(__global const Stored* g, __global const ulong* from, const ulong count, __global Stored* message) {
    size_t k = get_global_id(0);
    if (k < count) WRITE(message, k, READ(g, from[k]));
}

__kernel void unpack(__global Stored* g, __global const ulong* to, const ulong at, const ulong count,
                     __global const Stored* message, const ulong first) {
    size_t k = get_global_id(0);
    if (k < count) WRITE(g, to[at + k], READ(message, first + k));
}

// Momentum and moving mass that left some cells in the last sweep; `left` is by the phase.
__kernel void departed(__global const Stored* g, __global const ulong* left, __global const ulong* cells, const ulong count,
                       __global double* sums) {
    size_t k = get_global_id(0);
    if (k >= count) return;
    double sum[4] = {0.0, 0.0, 0.0, 0.0};
    for (int i = 1; i < Q; i++) {
        double population = (double)UNSCALED(READ(g, cells[k] + left[i]));
        for (int a = 0; a < 3; a++) sum[a] = sum[a] + (double)C[i][a] * population;
        sum[3] = sum[3] + population;
    }
    for (int a = 0; a < 4; a++) sums[4 * k + a] = sum[a];
}
