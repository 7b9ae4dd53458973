/* Vectors and matrices (row by row) of REAL numbers: included once for numbers and once for lanes.

   REAL, VEC, MAT are the types; OF(name) is the name of a function on them. */

typedef struct {
    REAL x, y, z;
} VEC;

typedef struct {
    REAL a[9];
} MAT;

static inline VEC OF(plus)(VEC a, VEC b) { return (VEC){a.x + b.x, a.y + b.y, a.z + b.z}; }

static inline VEC OF(minus)(VEC a, VEC b) { return (VEC){a.x - b.x, a.y - b.y, a.z - b.z}; }

static inline VEC OF(times)(REAL s, VEC a) { return (VEC){s * a.x, s * a.y, s * a.z}; }

static inline REAL OF(dot)(VEC a, VEC b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

static inline VEC OF(cross)(VEC a, VEC b) {
    return (VEC){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/* M a, and M^T a. */
static inline VEC OF(turn)(const MAT *m, VEC a) {
    const REAL *k = m->a;
    return (VEC){k[0] * a.x + k[1] * a.y + k[2] * a.z, k[3] * a.x + k[4] * a.y + k[5] * a.z,
                 k[6] * a.x + k[7] * a.y + k[8] * a.z};
}

static inline VEC OF(turn_back)(const MAT *m, VEC a) {
    const REAL *k = m->a;
    return (VEC){k[0] * a.x + k[3] * a.y + k[6] * a.z, k[1] * a.x + k[4] * a.y + k[7] * a.z,
                 k[2] * a.x + k[5] * a.y + k[8] * a.z};
}

static inline MAT OF(mul)(const MAT *a, const MAT *b) {
    MAT found;
    for (int i = 0; i < 9; i += 3)
        for (int j = 0; j < 3; j++)
            found.a[i + j] = a->a[i] * b->a[j] + a->a[i + 1] * b->a[3 + j] + a->a[i + 2] * b->a[6 + j];
    return found;
}

static inline MAT OF(transposed)(const MAT *m) {
    const REAL *k = m->a;
    return (MAT){{k[0], k[3], k[6], k[1], k[4], k[7], k[2], k[5], k[8]}};
}

static inline MAT OF(add)(MAT a, MAT b) {
    for (int k = 0; k < 9; k++) a.a[k] += b.a[k];
    return a;
}

static inline MAT OF(less)(MAT a, MAT b) {
    for (int k = 0; k < 9; k++) a.a[k] -= b.a[k];
    return a;
}

static inline MAT OF(scale)(REAL s, MAT a) {
    for (int k = 0; k < 9; k++) a.a[k] *= s;
    return a;
}

/* [a], with [a] b = a x b. */
static inline MAT OF(skew)(VEC a) {
    REAL none = {0};
    return (MAT){{none, -a.z, a.y, a.z, none, -a.x, -a.y, a.x, none}};
}

/* [a] M. */
static inline MAT OF(across)(VEC a, const MAT *m) {
    MAT found;
    for (int j = 0; j < 3; j++) {
        found.a[j] = a.y * m->a[6 + j] - a.z * m->a[3 + j];
        found.a[3 + j] = a.z * m->a[j] - a.x * m->a[6 + j];
        found.a[6 + j] = a.x * m->a[3 + j] - a.y * m->a[j];
    }
    return found;
}

/* p y^T + p . y - 2 y p^T. */
static inline MAT OF(bow)(VEC p, VEC y) {
    REAL m = OF(dot)(p, y);
    return (MAT){{m - p.x * y.x, p.x * y.y - 2.0 * y.x * p.y, p.x * y.z - 2.0 * y.x * p.z,
                  p.y * y.x - 2.0 * y.y * p.x, m - p.y * y.y, p.y * y.z - 2.0 * y.y * p.z,
                  p.z * y.x - 2.0 * y.z * p.x, p.z * y.y - 2.0 * y.z * p.y, m - p.z * y.z}};
}

/* R diag(along, across, across) R^T = across + (along - across) x x^T, with x the first axis. */
static inline MAT OF(in_space)(const MAT *axes, REAL along, REAL across) {
    REAL more = along - across, x = axes->a[0], y = axes->a[3], z = axes->a[6];
    return (MAT){{across + more * x * x, more * x * y, more * x * z,
                  more * x * y, across + more * y * y, more * y * z,
                  more * x * z, more * y * z, across + more * z * z}};
}
