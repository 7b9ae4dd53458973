/* Rotations, of numbers and of lanes; and what the library says of itself. */

#include "core.h"

/* Angle (rad) below which series stand for sines and arcs, at a third of their cost: what they leave
   out is below 1e-16. */
static const D SERIES = 0.05;

/* sin k / k and (1 - cos k) / k^2 by their series, of the square of k. */
#define SINE_SERIES(q) (1.0 - (q) / 6.0 * (1.0 - (q) / 20.0 * (1.0 - (q) / 42.0)))
#define COSINE_SERIES(q) (0.5 * (1.0 - (q) / 12.0 * (1.0 - (q) / 30.0 * (1.0 - (q) / 56.0))))
/* k / sin k of the square of the sine. */
#define ARC_SERIES(q)                                                                              \
    (1.0 + (q) / 6.0 *                                                                             \
               (1.0 + (q) * (0.45 + (q) * (15.0 / 56.0 + (q) * (105.0 / 576.0 + (q) * (945.0 / 7040.0))))))

/* I + s [a] + c [a]^2, Rodrigues' formula. */
#define RODRIGUES(MAT, a, s, c)                                                                    \
    (MAT) {                                                                                        \
        {                                                                                          \
            1.0 - c * (a.y * a.y + a.z * a.z), c *a.x *a.y - s *a.z, c *a.x *a.z + s *a.y,         \
                c *a.x *a.y + s *a.z, 1.0 - c * (a.x * a.x + a.z * a.z), c *a.y *a.z - s *a.x,     \
                c *a.x *a.z - s *a.y, c *a.y *a.z + s *a.x, 1.0 - c * (a.x * a.x + a.y * a.y)      \
        }                                                                                          \
    }

Mat turned(Vec a) {
    D square = dot(a, a), s, c;
    if (square < SERIES * SERIES) {
        s = SINE_SERIES(square), c = COSINE_SERIES(square);
    } else {
        D angle = sqrt(square), half = sin(0.5 * angle) / angle;
        s = sin(angle) / angle, c = 2.0 * half * half;
    }
    return RODRIGUES(Mat, a, s, c);
}

Mat turned_about_z(D angle) {
    D c = cos(angle), s = sin(angle);
    return (Mat){{c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0}};
}

static D arc_over_sine(D square, D cosine) {
    if (square < SERIES * SERIES && cosine > 0.0) return ARC_SERIES(square);
    D sine = sqrt(square);
    return atan2(sine, cosine) / sine;
}

/* For angles below pi. */
Vec rotation_vector(const Mat *m) {
    const D *k = m->a;
    Vec a = {0.5 * (k[7] - k[5]), 0.5 * (k[2] - k[6]), 0.5 * (k[3] - k[1])};
    return times(arc_over_sine(dot(a, a), 0.5 * (k[0] + k[4] + k[8] - 1.0)), a);
}

Mat4 turned4(Vec4 a) {
    V square = dot4(a, a), s = SINE_SERIES(square), c = COSINE_SERIES(square);
    if (any(square >= SERIES * SERIES))
        for (int k = 0; k < LANES; k++)
            if (square[k] >= SERIES * SERIES) {
                D angle = sqrt(square[k]), half = sin(0.5 * angle) / angle;
                s[k] = sin(angle) / angle, c[k] = 2.0 * half * half;
            }
    return RODRIGUES(Mat4, a, s, c);
}

Vec4 rotation_vector4(const Mat4 *m) {
    const V *k = m->a;
    Vec4 a = {0.5 * (k[7] - k[5]), 0.5 * (k[2] - k[6]), 0.5 * (k[3] - k[1])};
    V square = dot4(a, a), cosine = 0.5 * (k[0] + k[4] + k[8] - 1.0), factor = ARC_SERIES(square);
    if (any((square >= SERIES * SERIES) | (cosine <= 0.0)))
        for (int n = 0; n < LANES; n++) factor[n] = arc_over_sine(square[n], cosine[n]);
    return times4(factor, a);
}

/* Of which sources this was compiled, and the size of each table in words of eight bytes. */

_Static_assert(sizeof(void *) == 8 && sizeof(I) == 8 && sizeof(D) == 8, "words of eight bytes");

const char *compiled_from(void) { return SOURCES; }

#define WORDS(table) (I)(sizeof(table) / sizeof(I))

I words_of_table(I number) {
    const I words[] = {WORDS(Mesh), WORDS(Pose), WORDS(Strains), WORDS(Fronts), WORDS(Border),
                       WORDS(Tape), WORDS(Acting), WORDS(Web), WORDS(Coefficients), WORDS(Followed),
                       WORDS(Moving), WORDS(Held), WORDS(PathPoints), WORDS(Arms), WORDS(PulleyLaws), WORDS(RopeTable),
                       WORDS(Drums), WORDS(Spans), WORDS(Seen), WORDS(Answering), WORDS(Roped), WORDS(System)};
    return words[number];
}
